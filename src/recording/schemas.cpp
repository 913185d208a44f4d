#include "recording/schemas.hpp"

#include "types/ros_tf.hpp"

namespace tfdude::recording {
namespace {

constexpr std::string_view kKeyframeDefinition =
    R"(# All that is known follows once more: messages with `repeats`, up to the one that says so.
# Who starts to read here needs nothing before; others ignore these messages.
bool ends
)";

constexpr std::string_view kFramesDefinition =
    R"(# The frames of a partition, and whether its owner is reachable.
string partition
uint64 incarnation  # of the owner's process
bool reachable
string why          # if it is not
bool complete       # the partition has no other frames
bool repeats        # see Keyframe
Frame[] frames      # new, or under another parent
string[] removed
================================================================================
MSG: tfdude_msgs/Frame
string id
string parent       # empty: a root
)";

constexpr std::string_view kValuesDefinition =
    R"(# What the owner of a partition has written in one commit, or in several consecutive ones.
string partition
uint64 commit
bool repeats        # see Keyframe
Value[] values
Kept[] kept
================================================================================
MSG: tfdude_msgs/Kept
# The past was rewritten: of the history before the one that begins with a value, the samples before
# this instant still hold.
uint32 value        # index among the values
int64 before        # nanoseconds
================================================================================
MSG: tfdude_msgs/Value
# The value of the edge from a frame's parent to the frame.
string frame
string parent
int64 stamp         # nanoseconds; -1: none, the value holds for all times
                    # -2: no value, the history was cleared and the next sample follows
                    # -3: the value is that of no instant, the first sample follows
uint8 GIVEN = 0
uint8 UNSPECIFIED = 1
uint8 AS_BEFORE = 2 # as in the edge's value before this one
uint8 covariance_is
uint8 NOT = 0
uint8 ANEW = 1      # a new history: earlier values of the edge do not hold any more
uint8 DRIFTING = 2  # the same, and its error goes on from each sample to the next
uint8 begins
float64[7] pose     # x, y, z, w of the unit quaternion; x, y, z [m]
# Upper triangle of the 6x6 covariance, row by row, of the right perturbation: translation [m],
# then rotation [rad]. Without the part that is shared with other edges.
float64[] covariance
float64[] process_noise  # per second; likewise; with `begins`, if there is any
# How the error of the edge is correlated with others, from the last of its values here on. If a
# sample names edges that it was observed with: how the error of this sample is.
bool unknown        # its own part may be correlated with anything
CommonError[] common_errors
string[] observed_with
================================================================================
MSG: tfdude_msgs/CommonError
string source
bool subtracts
float64[] loading   # 6xk, column by column
)";

constexpr std::string_view kJointsDefinition =
    R"(# The joints of a partition, once a second if they have changed.
string partition
bool repeats        # see Keyframe
Joint[] joints
================================================================================
MSG: tfdude_msgs/Joint
string name
string frame        # that it moves
uint8 REVOLUTE = 1
uint8 CONTINUOUS = 2
uint8 PRISMATIC = 3
uint8 type
bool measured       # by a sample
float64 position    # [rad or m]
float64[] variance  # none: unspecified
float64[] limits    # lower and upper, or none
string mimics       # another joint; empty: none
float64 multiplier
float64 offset
uint64 outside      # how many positions were outside of the limits
uint64 refused
)";

constexpr std::string_view kEventsDefinition = R"(# A change, as the recorder saw it.
string kind
string partition
string frame
string parent
string rival
string message
int64 time          # nanoseconds
bool stopped
)";

// tf_static: reliable, transient local, depth 1. The numbers are those of rmw.
constexpr std::string_view kStaticQos = R"(- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
)";

}  // namespace

const std::array<TopicType, 7>& topic_types() {
  static const std::array<TopicType, 7> kTypes{{
      {Topic::kTf, "/tf", ros::kTfType, ros::kTfDefinition, ""},
      {Topic::kTfStatic, "/tf_static", ros::kTfType, ros::kTfDefinition, kStaticQos},
      {Topic::kKeyframe, "/tfdude/keyframe", "tfdude_msgs/msg/Keyframe", kKeyframeDefinition, ""},
      {Topic::kFrames, "/tfdude/frames", "tfdude_msgs/msg/Frames", kFramesDefinition, ""},
      {Topic::kValues, "/tfdude/values", "tfdude_msgs/msg/Values", kValuesDefinition, ""},
      {Topic::kJoints, "/tfdude/joints", "tfdude_msgs/msg/Joints", kJointsDefinition, ""},
      {Topic::kEvents, "/tfdude/events", "tfdude_msgs/msg/Event", kEventsDefinition, ""},
  }};
  return kTypes;
}

}  // namespace tfdude::recording
