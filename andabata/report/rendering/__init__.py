"""Pictures of worlds and robots in perspective, by rays and a depth buffer, without a screen."""
