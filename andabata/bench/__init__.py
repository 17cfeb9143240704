"""Speed and accuracy, ours and the peers', behind ``andabata bench``."""
