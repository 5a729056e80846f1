"""The paper's Figs. 7 to 12 and Table III beside what it prints: a page, the numbers, pictures."""

import pavefem as pf

paper = pf.studies.reproduce_paper()
for name, value in paper.summary().items():
    print(f"{name:22} {value}")
for path in paper.save("paper"):
    print(path)
