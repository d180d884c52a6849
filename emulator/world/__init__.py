"""The physical world around the board, as pure vectorised functions of virtual time in float seconds.

World frame: X north, Y west, Z up. Board axes: X right, Y forward, Z up out of the component side. An attitude
(roll, pitch, yaw) in degrees is R(board -> world) = Rz(yaw) Ry(pitch) Rx(roll). The specific force on a flat board
at rest is (0, 0, +1) g. Printed yaws are compared with `World.compass_deg`, which counts from magnetic north as in
the lab.
"""

from fcu_emulator.emulator.world.magnetism import earth_field
from fcu_emulator.emulator.world.recording import Recording, load_recording
from fcu_emulator.emulator.world.world import World

__all__ = ["Recording", "World", "earth_field", "load_recording"]
