"""The robot: its machine, localisation, navigation, tasks, records and command line.

Read ``navigation/navigator.py`` first: its ``step`` tells the whole story.

Importing the package registers its Gymnasium environments, which is how ``gymnasium.make`` finds
them; nothing else of it is imported.
"""

from andabata.interrupts import handle_interrupts, is_command_line

if is_command_line():  # Before the first library is imported.
    handle_interrupts()

from andabata.tasks.registration import register_environments

register_environments()
