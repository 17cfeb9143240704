"""The body and the senses: robot, kinematics, the two plants, lidar, proprioception, one clock."""
