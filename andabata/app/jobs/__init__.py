"""Long work of commands with its progress on the console, and the folders that it leaves."""
