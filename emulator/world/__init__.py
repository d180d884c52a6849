"""The physical world around the board: one truth that drives all sensors.

Everything is a pure, vectorised function of virtual time in float seconds; nothing here knows of sensors or
firmware.

Frames and signs
    World frame NWU: X north, Y west, Z up. Board axes: X right, Y forward, Z up out of the component side
    (COORDINATE_SYSTEM 3 of ST's firmware). Attitude (roll, pitch, yaw) in degrees is R(board -> world) =
    Rz(yaw) Ry(pitch) Rx(roll). Flat and still, the specific force is (0, 0, +1) g.

North
    The attitude's yaw is measured from the frame's north. A compass shows magnetic north, the direction of
    the horizontal part of the Earth's field; so does the lab, and so every printed yaw is compared with the
    yaw from magnetic north (`World.compass_deg`). The default field has no east part, and ``earth_field(...,
    north="magnetic")``, the default, turns a place's field so that it has none: the two norths are then one.
    A field with an east part (``north="true"``, or given so) puts magnetic north beside the frame's, which is
    then the geographic one.

Units are in the names. What a user gives as a magnetic field is NED microtesla (north, east, down).
"""

from fcu_emulator.emulator.world.magnetism import earth_field
from fcu_emulator.emulator.world.recording import Recording, load_recording
from fcu_emulator.emulator.world.world import World

__all__ = ["Recording", "World", "earth_field", "load_recording"]
