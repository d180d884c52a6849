"""Live boards: a board runs in real time while users move it, type to it and watch it.

``messages``: commands and events of a session, as data; ``session``: the board, its pace, and the execution
of commands; ``view``: the visible state of a board; ``recording``: the session as a scenario; ``server``: the
messages over a WebSocket, with the page.
"""
