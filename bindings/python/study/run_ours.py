import sys, time, collections
sys.path.insert(0, 'study')
import numpy as np, corpus
from spring_oracle import _native
def check(fn, seed=1):
    y=np.asarray(fn.f(0.5*(fn.lower+fn.upper)+1e-3*(fn.upper-fn.lower)))
    s=dict(domain=(list(fn.lower),list(fn.upper)),seed=seed,block=fn.block,factors=[("h",corpus.H),("m",corpus.MASS)],draws=4,search=fn.n<=60 or fn.switch is not None)
    return _native.check_jacobian(lambda x: np.ascontiguousarray(fn.f(x),dtype=float), lambda x: np.ascontiguousarray(fn.jac(x),dtype=float).ravel(), "dense",(len(y),fn.n),s)
if __name__=='__main__':
    np.seterr(all='ignore')
    which=sys.argv[1]; only=sys.argv[2] if len(sys.argv)>2 else ''
    t=time.time(); c=collections.Counter()
    if which in('right','both'):
        for fn in corpus.rights():
            if only not in fn.name: continue
            t0=time.time(); r=check(fn); c['right '+r['verdict']]+=1
            dt=time.time()-t0
            if r['verdict']!='correct' or dt>3: print('RIGHT',fn.hard,'|',fn.name,'|',round(dt,1),r['text'] if r['verdict']=='wrong' or only else (r['verdict'],r['reason']))
            elif only: print(fn.name, r['text'])
    if which in('wrong','both'):
        for m in corpus.mistakes():
            if only not in m.name: continue
            t0=time.time(); r=check(m.function); c['wrong '+r['verdict']]+=1
            dt=time.time()-t0
            c[m.kind.split(',')[0]]+=0
            if r['verdict']!='wrong': print('MISSED',m.name,round(dt,1),(r['verdict'],r['reason']), r['text'] if only else '')
            else: print(f"  {m.kind:24} {r['on_branch']!s:5} {r['likeness']}  [{m.function.name}] {dt:.1f}")
    print(c, time.time()-t)
