#pragma once

// The messages of the foreign peer as lines of text: fields separated by blanks, times in
// nanoseconds, numbers with all their digits.
//   tf         STAMP (PARENT CHILD x y z qx qy qz qw)...
//   joints     STAMP (NAME POSITION)...
//   string     TEXT up to the end of the line; or @FILE
//   pose       STAMP FRAME x y z qx qy qz qw (36 numbers, or one that stands for all)
//   odometry   STAMP FRAME CHILD x y z ... as pose
//   objects    STAMP FRAME (ID x y z qx qy qz qw VARIANCE)...    Detection3DArray
//   tags       as objects                                       AprilTagDetectionArray of Isaac ROS
//   markers    as objects, whose variances are not sent         ArucoMarkers
//   navsat     STAMP FRAME STATUS LAT LON ALT TYPE VARIANCE (of east, north and up)    NavSatFix
//   geopose    STAMP FRAME LAT LON ALT qx qy qz qw                                 GeoPoseStamped
//   clock      STAMP

#include <dds/dds.h>

typedef struct {
  const char* name;
  const dds_topic_descriptor_t* type;
  // Reads a message from the rest of a line. Its memory is never freed: the process is short-lived.
  void* (*parse)(char* text);
  void (*print)(const char* topic, const void* message);
} Kind;

// @return NULL if there is no such kind
const Kind* find_kind(const char* name);
