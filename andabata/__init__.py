"""The robot: its machine, localisation, navigation, tasks, records and command line.

Read ``navigation/navigator.py`` first: its ``step`` tells the whole story.

Importing the package registers its Gymnasium environments, which is how ``gymnasium.make`` finds
them; nothing else of it is imported.
"""

from andabata.tasks.registration import register_environments

register_environments()
