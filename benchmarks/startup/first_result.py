"""The first result of a process: the tip of a seven-body chain after 0.1 s.

python first_result.py SCENE ENGINE
"""

import sys

import mstmm

model = mstmm.compile(mstmm.load_scene(sys.argv[1]), engine=sys.argv[2])
print(model.simulate(t_end=0.1).position("rod6.tip")[-1])
