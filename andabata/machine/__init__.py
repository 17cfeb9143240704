"""Body and sensors of the robot: parameters, kinematics, plants, laser, proprioception, clock."""
