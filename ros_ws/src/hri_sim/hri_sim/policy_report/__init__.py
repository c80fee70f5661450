"""The report of learnt policies: every table and picture of the thesis' chapter, and the bars."""
