// A recording that was dropped on the page: sends it to the server, which shows it to this page instead of the robot.
import { element } from './text.js';

const PIECE = 65536;    // [B]; docs/web.md
const AHEAD = 8;        // pieces that the server has not written yet

export class Recording {
  /** @param on  functions: send(request), piece(buffer), enter(message), leave() */
  constructor(on) {
    this.on = on;
    this.shown = null;     // name of the file
    this.coming = null;    // {file, sent, written, reading}
    this.error = '';
    this.box = document.getElementById('banner');
    this.depth = 0;        // of elements that a file is dragged over
    this.listen();
  }

  listen() {
    const hasFiles = (event) => [...(event.dataTransfer ? event.dataTransfer.types : [])].includes('Files');
    const over = (change) => (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.depth = Math.max(0, this.depth + change);
      document.body.classList.toggle('dropping', this.depth > 0);
    };
    window.addEventListener('dragenter', over(1));
    window.addEventListener('dragover', over(0));
    window.addEventListener('dragleave', over(-1));
    window.addEventListener('drop', (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.depth = 0;
      document.body.classList.remove('dropping');
      this.drop([...event.dataTransfer.files]);
    });
  }

  drop(files) {
    if (files.length !== 1) return this.fail('Drop one file.');
    if (this.coming) return this.fail('Another file is on its way.');
    this.error = '';
    this.coming = { file: files[0], sent: 0, written: 0, reading: false };
    this.on.send({ op: 'upload', bytes: files[0].size });
    return this.draw();
  }

  /** The server has written so much. */
  async take({ written }) {
    const { coming } = this;
    if (!coming || written > coming.sent) return;  // of a file that was given up
    coming.written = written;
    this.draw();
    if (coming.reading) return;
    coming.reading = true;
    const { file } = coming;
    try {
      while (coming.sent < file.size && coming.sent - coming.written < AHEAD * PIECE) {
        const piece = await file.slice(coming.sent, coming.sent + PIECE).arrayBuffer();
        if (this.coming !== coming) return;
        if (piece.byteLength === 0) throw new Error('it has become shorter');
        coming.sent += piece.byteLength;
        this.on.piece(piece);
      }
    } catch (error) {
      if (this.coming !== coming) return;
      this.cancel();
      this.fail(`The file cannot be read: ${error.message}`);
    }
    coming.reading = false;
  }

  /** The server shows the recording, or says why it does not. */
  takeAnswer(message) {
    if (message.error) {
      this.coming = null;
      return this.fail(message.error);
    }
    if (!this.coming) return this.leave();  // it was given up meanwhile
    this.shown = this.coming.file.name;
    this.coming = null;
    this.about = message;
    this.error = '';
    this.on.enter(message);
    return this.draw();
  }

  /** Gives the file up that is on its way. */
  cancel() {
    this.coming = null;
    this.error = '';
    this.on.send({ op: 'cancel' });
    this.draw();
  }

  /** Asks for the robot. */
  leave() {
    this.coming = null;
    this.error = '';
    this.on.send({ op: 'robot' });
    this.draw();
  }

  /** The server shows the robot. */
  left() {
    if (!this.shown) return;
    this.shown = null;
    this.on.leave();
    this.draw();
  }

  /** The server of a connection that was lost has forgotten the file. */
  lost() {
    if (!this.shown && !this.coming) return;
    this.coming = null;
    this.left();
    this.fail('The connection was lost, and the recording with it. Drop it again.');
  }

  fail(error) {
    this.error = error;
    this.draw();
  }

  draw() {
    const { shown, coming, error } = this, parts = [];
    if (shown) {
      const { problems, finished, foreign } = this.about;
      const remarks = [...(finished ? [] : ['Its writer was interrupted.']), ...problems];
      parts.push(element('b', { title: shown }, shown),
        foreign ? ' is a recording of ROS, not the robot.' : ' is a recording, not the robot.');
      if (remarks.length) parts.push(element('span', { class: 'warn', title: remarks.join('\n') }, ' It has gaps.'));
    }
    if (coming) {
      const { file, written } = coming, part = file.size ? Math.floor((100 * written) / file.size) : 0;
      parts.push(element('span', { title: file.name },
        ` ${part < 100 ? `Sending ${file.name}: ${part} %` : `Reading ${file.name}`}`));
    }
    if (error) parts.push(element('span', { class: 'bad' }, ` ${error}`));
    if (coming) parts.push(element('button', { onclick: () => this.cancel() }, 'Cancel'));
    if (shown) parts.push(element('button', { id: 'to-robot', onclick: () => this.leave() }, 'Back to the robot'));
    else if (error && !coming) parts.push(element('button', { onclick: () => this.fail('') }, 'Close'));
    this.box.hidden = parts.length === 0;
    this.box.replaceChildren(...parts);
  }
}
