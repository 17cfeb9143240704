"""Robot, world and learning put together: Gymnasium environments and labelled clouds."""
