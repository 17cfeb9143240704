"""A robot put together once: world, simulator, localizer, perception, planner and controller."""
