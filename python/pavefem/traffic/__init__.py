"""Traffic: which vehicle comes onto which lane, when, how fast and how far to the side.

`Traffic` is a table of passages. It is generated (`Traffic.generate`), made from arrays or a
DataFrame, or read from floating-car data of SUMO (`read_sumo`).
"""

from pavefem.traffic.sumo import read_sumo
from pavefem.traffic.table import Traffic

__all__ = ["Traffic", "read_sumo"]
