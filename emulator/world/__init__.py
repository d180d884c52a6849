"""The physical world around the board: one truth that drives all sensors.

Everything is a pure, vectorised function of virtual time in float seconds, independent of sensors and
firmware.

Frames and signs
    World frame NWU: X north, Y west, Z up. Board axes: X right, Y forward, Z up out of the component side
    (COORDINATE_SYSTEM 3 of ST's firmware). Attitude (roll, pitch, yaw) in degrees is R(board -> world) =
    Rz(yaw) Ry(pitch) Rx(roll). Flat and still, the specific force is (0, 0, +1) g.

North
    The attitude's yaw is measured from the frame's north. A compass shows magnetic north, the direction of
    the horizontal part of the Earth's field, and so does the lab. Every printed yaw is therefore compared with
    the yaw from magnetic north (`World.compass_deg`). The default field has no east part, and
    ``earth_field(..., north="magnetic")``, the default, removes the east part of a place's field by turning
    it: both norths are then the same. With an east part (``north="true"``, or given explicitly), magnetic
    north differs from the frame's, which is then the geographic one.

Units are in the names. Users give a magnetic field in NED microtesla (north, east, down).
"""

from fcu_emulator.emulator.world.magnetism import earth_field
from fcu_emulator.emulator.world.recording import Recording, load_recording
from fcu_emulator.emulator.world.world import World

__all__ = ["Recording", "World", "earth_field", "load_recording"]
