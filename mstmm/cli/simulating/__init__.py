"""`mstmm simulate`: what is asked, the run, what is kept and told of it."""
