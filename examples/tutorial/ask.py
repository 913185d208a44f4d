"""What the command line asks in the tutorial, asked in Python."""

import tfdude

with tfdude.Client() as robot:
    X = robot.lookup("odom", "gripper", timeout=5)
    print(X)                                            # pose, standard deviations, stamp
    print(X.stamp, X.stddev_in_parent)
    print([f"{joint.name}: {joint.position:.2f}" for joint in robot.joints("arm", timeout=5)])

    stamp = robot.now() - 200_000_000                   # 0.2 s ago, between two samples
    print(robot.lookup("odom", "gripper", stamp).translation)
    print(robot.velocity("odom", "gripper", over=0.5).linear)

    why = robot.why("gripper", "cup")                   # what makes the answer uncertain
    print([f"{name}: {share:.0%}" for name, variance, share in why.edges], why.best)

    try:
        robot.lookup("odom", "griper")
    except tfdude.LookupException as error:
        print(error.code, error.frame, robot.why("odom", "griper").cause.similar)
