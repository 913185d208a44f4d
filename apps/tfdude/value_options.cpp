#include "value_options.hpp"

namespace tfdude::cli {
namespace {

void add_pace(CLI::App* command, Arguments& arguments, CLI::Option* file) {
  command->add_option("--rate", arguments.pace, "lines per second; default: as they come")
      ->type_name("HZ")
      ->check(within(0.001, 1e5, "0.001 to 100000"))
      ->needs(file);
}

void add_joint_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* joint =
      add_command(app, "joint", "set positions of joints, as one commit of each owner",
                  "joint shoulder_pan_joint=0.5 elbow_joint=1.6 --stddev 0.001", run_joint, chosen);
  auto* joints = joint->add_option("JOINTS", arguments.joints,
                                   "NAME=POSITION of each joint, or one NAME POSITION [rad or m]");
  joint
      ->add_option("--stddev", arguments.joint_stddev,
                   "standard deviation of the positions [rad or m]")
      ->type_name("NUMBER")
      ->check(within(0, 1e9, "0 to 1e9"));
  add_sample_stamp(joint, arguments);
  auto* from = joint->add_option("--from", arguments.from,
                                 "positions from this file, or - for standard input: the lines of "
                                 "tfdude publish, each acknowledged");
  from->type_name("FILE")->excludes(joints)->excludes("--stamp")->excludes("--stddev");
  add_pace(joint, arguments, from);
  explain_angles(*joint);
}

void add_publish_command(CLI::App& app, Arguments& arguments, Command& chosen) {
  auto* publish = add_command(
      app, "publish", "stream edges and joints from lines of JSON or CSV, not acknowledged",
      R"(publish - <<< '{"joints": {"elbow_joint": 1.6}, "stamp": 1795000000.5}')", run_publish,
      chosen);
  auto* file = publish->add_option("FILE", arguments.from, "the samples; -: standard input");
  file->type_name("FILE")->required();
  add_pace(publish, arguments, file);
  publish->footer(
      "A line of JSON: {\"edge\": ID, \"xyz\": [...], \"rpy\" or \"quat\" or \"matrix\": [...], "
      "\"stddev\" or \"cov\": [...]}, or {\"edges\": [such objects]}, or {\"joints\": {NAME: "
      "POSITION, ...}, \"stddev\": NUMBER}; with \"stamp\" in seconds or \"stamp_ns\".\n"
      "CSV begins with a line of names: edge, x, y, z, roll, pitch, yaw or qx, qy, qz, qw; or the "
      "names of joints; and stamp or stamp_ns.\n" +
      publish->get_footer());
  explain_angles(*publish);
}

void add_point_command(CLI::App& app, Arguments& arguments, Command& chosen, LocalCommand& local) {
  auto* point = add_command(app, "point", "points of frame B, in frame A, with their covariance",
                            "point world hand_left 0 0 0.1", run_point, chosen);
  add_ends(point, arguments);
  point->add_option("POINT", arguments.points, "coordinates in B [m], three for each point")
      ->type_name("X Y Z ...")
      ->required();
  auto* cov = point->add_option("--cov", arguments.point_cov,
                                "covariance of each point: upper triangle row by row [m²]; "
                                "default: the points are exact in B");
  cov->type_name("6 NUMBERS")->expected(6);
  point->add_option("--stddev", arguments.point_stddev, "standard deviations of each point [m]")
      ->type_name("3 NUMBERS")
      ->expected(3)
      ->excludes(cov);
  point->add_flag("--direction", arguments.direction, "directions, which are only turned");
  point->add_flag("--joint", arguments.joint_covariance,
                  "print the covariance of all points together");
  add_order(point, arguments);
  add_instant(point, arguments);
  add_recording(point, arguments, local, run_point);
  point->parse_complete_callback([&arguments] {
    if (arguments.points.size() % 3 == 0) return;
    throw CLI::ValidationError("POINT", "three coordinates for each point are needed, not " +
                                            std::to_string(arguments.points.size()) + " in all");
  });
}

}  // namespace

void add_value_commands(CLI::App& app, Arguments& arguments, Command& chosen, LocalCommand& local) {
  auto* joints =
      add_command(app, "joints", "list all joints: positions, limits, which joint they mimic",
                  "joints", run_joints, chosen);
  add_recording(joints, arguments, local, run_joints);
  explain_angles(*joints);
  add_joint_command(app, arguments, chosen);
  add_publish_command(app, arguments, chosen);
  add_point_command(app, arguments, chosen, local);
}

}  // namespace tfdude::cli
