"""Main register bank of the LSM6DSL by groups (datasheet DocID028475 Rev 7, Table 19, section 9).

Each module follows the order of the datasheet. Units and codes are the datasheet's, completed from
application note AN5040 Rev 3. A status or output register, whose reset the datasheet leaves open, is declared
0; FIFO_STATUS2 is 0x10, an empty FIFO.
"""

from sensors.lsm6dsl.registers.access import *
from sensors.lsm6dsl.registers.control import *
from sensors.lsm6dsl.registers.embedded import *
from sensors.lsm6dsl.registers.fifo import *
from sensors.lsm6dsl.registers.hub import *
from sensors.lsm6dsl.registers.interrupt import *
from sensors.lsm6dsl.registers.output import *
