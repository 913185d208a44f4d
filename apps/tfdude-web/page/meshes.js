// What the links of a robot look like, if the server was given its URDF.
import * as THREE from '/three/build/three.module.js';
import { ColladaLoader } from '/three/examples/jsm/loaders/ColladaLoader.js';
import { STLLoader } from '/three/examples/jsm/loaders/STLLoader.js';

export class Meshes {
  constructor(scene) {
    this.scene = scene;
    this.links = new Map();      // id: group
    this.count = 0;
  }

  /** @return whether there is anything to show */
  async load() {
    const { visuals } = await (await fetch('/robot.json')).json();
    for (const visual of visuals) {
      const made = this.shape(visual);
      const place = new THREE.Group();
      place.position.set(...visual.xyz);
      place.rotation.set(visual.rpy[0], visual.rpy[1], visual.rpy[2], 'ZYX');   // about fixed axes, in turn
      place.add(made);
      this.link(visual.link).add(place);
      ++this.count;
    }
    if (this.count) {
      const lamp = new THREE.DirectionalLight(0xffffff, 0.7);
      lamp.position.set(3, -5, 8);
      this.scene.scene.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 0.75), lamp);
    }
    return this.count > 0;
  }

  link(id) {
    if (!this.links.has(id)) {
      const group = new THREE.Group();
      group.visible = false;
      group.material = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.75, side: THREE.DoubleSide });
      this.scene.scene.add(group);
      this.links.set(id, group);
    }
    return this.links.get(id);
  }

  shape(visual) {
    const { material } = this.link(visual.link);
    if (visual.box) return new THREE.Mesh(new THREE.BoxBufferGeometry(...visual.box), material);
    if (visual.sphere) return new THREE.Mesh(new THREE.SphereBufferGeometry(visual.sphere, 24, 16), material);
    const holder = new THREE.Group();
    if (visual.cylinder) {
      const [radius, length] = visual.cylinder;
      const mesh = new THREE.Mesh(new THREE.CylinderBufferGeometry(radius, radius, length, 32), material);
      mesh.rotation.x = Math.PI / 2;       // along z, as in a URDF
      holder.add(mesh);
      return holder;
    }
    holder.scale.set(...visual.scale);
    const show = () => { this.scene.dirty = true; };
    if (visual.mesh.endsWith('.stl')) {
      new STLLoader().load(visual.mesh, (geometry) => {
        geometry.computeVertexNormals();   // those of a file are often zero
        holder.add(new THREE.Mesh(geometry, material));
        show();
      });
    } else {
      new ColladaLoader().load(visual.mesh, ({ scene }) => {
        scene.rotation.set(0, 0, 0);       // the loader turns z up to y up
        scene.traverse((one) => {
          if (!one.isMesh) return;
          one.material = material;
          if (!one.geometry.attributes.normal) one.geometry.computeVertexNormals();
        });
        holder.add(scene);
        show();
      });
    }
    return holder;
  }

  /** Moves the links to where their frames are. */
  update() {
    const { model, anchor, show } = this.scene;
    for (const [id, group] of this.links) {
      const i = model.index.get(id);
      group.visible = Boolean(show.meshes && i !== undefined && this.scene.isDrawn(i));
      if (!group.visible) continue;
      const p = 7 * i, { pose } = model;
      group.quaternion.set(pose[p], pose[p + 1], pose[p + 2], pose[p + 3]);
      group.position.set(pose[p + 4] - anchor[0], pose[p + 5] - anchor[1], pose[p + 6] - anchor[2]);
      group.material.color.copy(this.scene.colourOf(i)).lerp(new THREE.Color(0xc4cad6), 0.7);
      group.material.opacity = model.isReachable(i) ? 0.8 : 0.35;
    }
  }
}
