"""The paper reproduced, every figure and table beside what it prints.

`sites` has the profiles, `readings` what is assumed, `cases` the runs, `numbers` what they come to,
`sensitivity` the paper's measure of it, `figures` the curves and how they compare; `drawing` and
`page` show them.
"""

from pavefem.studies.paper.reproduction import Reproduction, reproduce_paper
from pavefem.studies.paper.sensitivity import paper_sensitivity

__all__ = ["Reproduction", "paper_sensitivity", "reproduce_paper"]
