// Tells the owner of examples/arm/arm.yaml where a joint and an edge are, by Cyclone DDS alone:
//   cyclone_publish [DOMAIN]
// Ends with 0 when the owner has taken both.

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include <dds/dds.h>

#include "tfdude.h"  // of idlc and idl/tfdude.idl

static dds_entity_t checked(dds_entity_t result, const char* what) {
  if (result >= 0) return result;
  fprintf(stderr, "%s: %s\n", what, dds_strretcode(-result));
  exit(1);
}

// A DDS partition is a property of a publisher, hence one for each partition that is written to.
static dds_entity_t create_writer(dds_entity_t participant, const char* partition,
                                  const char* topic_name, const dds_topic_descriptor_t* type) {
  dds_qos_t* in_partition = dds_create_qos();
  dds_qset_partition1(in_partition, partition);
  dds_entity_t publisher =
      checked(dds_create_publisher(participant, in_partition, NULL), "publisher");
  dds_delete_qos(in_partition);

  dds_entity_t topic =
      checked(dds_create_topic(participant, type, topic_name, NULL, NULL), topic_name);

  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 64);
  dds_qset_data_representation(qos, 1,
                               (dds_data_representation_id_t[]){DDS_DATA_REPRESENTATION_XCDR1});
  dds_entity_t writer = checked(dds_create_writer(publisher, topic, qos, NULL), "writer");
  dds_delete_qos(qos);
  return writer;
}

// What is written before the owner's reader is known goes nowhere.
static void await_reader(dds_entity_t participant, dds_entity_t writer) {
  checked(dds_set_status_mask(writer, DDS_PUBLICATION_MATCHED_STATUS), "status mask");
  dds_entity_t waitset = checked(dds_create_waitset(participant), "waitset");
  checked(dds_waitset_attach(waitset, writer, writer), "waitset");
  if (checked(dds_waitset_wait(waitset, NULL, 0, DDS_SECS(10)), "waitset") == 0) {
    fputs("no owner was met within 10 s\n", stderr);
    exit(1);
  }
  checked(dds_delete(waitset), "waitset");
}

static void publish(dds_entity_t writer, const void* sample) {
  checked(dds_write(writer, sample), "write");
  checked(dds_wait_for_acks(writer, DDS_SECS(10)), "acknowledgement");
}

int main(int argc, char** argv) {
  const dds_domainid_t domain = argc > 1 ? (dds_domainid_t)strtoul(argv[1], NULL, 10) : 0;
  dds_entity_t participant = checked(dds_create_participant(domain, NULL, NULL), "participant");
  dds_entity_t joints = create_writer(participant, "arm", "tfdude/joint", &tfdude_wire_Joints_desc);
  dds_entity_t edges = create_writer(participant, "arm", "tfdude/update", &tfdude_wire_Update_desc);
  await_reader(participant, joints);
  await_reader(participant, edges);

  tfdude_wire_JointPosition elbow = {
      .id = "elbow_joint", .position = 0.5 /* rad */, .variance = 1e-6 /* rad^2 */};
  tfdude_wire_Joints positions = {
      .positions = {._maximum = 1, ._length = 1, ._buffer = &elbow},
      .stamp = dds_time(),  // nanoseconds since the UNIX epoch
  };
  publish(joints, &positions);

  // The tool in its parent: not turned, 0.2 m along z, with 1 mm and 0.01 rad of standard deviation on each axis.
  tfdude_wire_Edge tool = {
      .id = "tool0",
      .x_pc = {0, 0, 0, 1, 0, 0,
               0.2, [7] = 1e-6, [13] = 1e-6, [18] = 1e-6, [22] = 1e-4, [25] = 1e-4, [27] = 1e-4}};
  tfdude_wire_Update update = {
      .edges = {._maximum = 1, ._length = 1, ._buffer = &tool},
      .stamp = 0,  // it holds for all times
  };
  publish(edges, &update);

  checked(dds_delete(participant), "participant");
  return 0;
}
