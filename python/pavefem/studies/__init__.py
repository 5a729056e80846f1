"""Studies: the paper reproduced, and the measures by which it compares what matters."""

from pavefem.studies.paper import Reproduction, reproduce_paper
from pavefem.studies.sensitivity import paper_sensitivity

__all__ = ["Reproduction", "paper_sensitivity", "reproduce_paper"]
