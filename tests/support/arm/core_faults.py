"""Common parts of fault tests: the numbers of exceptions, and handlers that log the exception."""

from __future__ import annotations

from tests.support.arm.core_bench import store

MEM_MANAGE, BUS_FAULT, USAGE_FAULT, HARD_FAULT = 4, 5, 6, 3
ALL_ENABLED = store("SHCSR", 0x0007_0000)
NOWHERE = 0x6000_0000  # the external memory that this chip has not

HANDLERS = """
hard_fault:
mem_manage:
bus_fault:
usage_fault:
       mrs r2, ipsr
       log r2
       ldr r2, [sp, #24]
       log r2
       b .
"""
"""Handlers that log the exception and the return address in the frame."""
