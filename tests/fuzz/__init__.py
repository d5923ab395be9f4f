"""A fuzzer of the whole way of a scene: every number, list and string of the scenes of examples/
and docs/ is changed, what comes out is compiled, run by every method and looked at.

    python -m tests.fuzz --count 20000 --seed 7 --jobs 2      many, with a table at the end
    python -m tests.fuzz --replay found/x.json                one of the recorded ones again

Nothing but a refusal in words or a run may come back: `trial.GOOD` are the good answers.  Mutant
number i of a seed is always the same scene, whatever the number of jobs.
"""
