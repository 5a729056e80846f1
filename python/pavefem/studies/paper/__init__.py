"""The paper reproduced, every figure and table beside what it prints.

`sites` has the profiles, `readings` what is assumed, `cases` the runs, `numbers` what they come to,
`figures` the curves and how they compare; `drawing` and `page` show them.
"""

from pavefem.studies.paper.reproduction import Reproduction, reproduce_paper

__all__ = ["Reproduction", "reproduce_paper"]
