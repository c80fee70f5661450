"""The report on policies that improve by people: the thesis' chapter 7, with simulated ones."""
