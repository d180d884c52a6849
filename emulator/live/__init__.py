"""A board that lives: it runs in real time, is moved by hand, typed to and looked at while it runs.

``messages``: what is said to it and what it says, as data; ``session``: the board, its pace, and what is
done with it; ``view``: what is shown of a board; ``recording``: the session as a scenario; ``server``: the
same messages over a WebSocket, with the page.
"""
