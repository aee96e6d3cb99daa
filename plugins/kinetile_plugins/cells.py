"""quick"""
from __future__ import annotations
import math
from typing import NamedTuple
import numpy as np
from kinetile.scene import Scene
from kinetile.kernel.compiled import larger
from kinetile.kernel.vectors import append
from kinetile.toolbox import BroadPhaseParts, Kernel, Records, hook, schedule, NEVER, positions_now

class State(NamedTuple):
    cells: Records
    cell: Records
    cross: Records
    shape: Records
    edges: Records
    side: Records

@hook
def watch(k, s, body):
    b=k.bodies[body]; c=k.clock[0]
    stride=s.shape[0]
    cx=s.edges[body,0]; cy=s.edges[body,1]
    t=np.inf; d=0
    side=s.side[0]
    if b.vx<0.0:
        t=(cx-b.x)/b.vx; d=0
    elif b.vx>0.0:
        t=(cx+side-b.x)/b.vx; d=1
    if b.vy<0.0:
        u=(cy-b.y)/b.vy
        if u<t: t=u; d=2
    elif b.vy>0.0:
        u=(cy+side-b.y)/b.vy
        if u<t: t=u; d=3
    s.cross[body]=d
    ticks=t*c.per_time
    if ticks<4.6e18: schedule(k,body,larger(b.anchor+int(math.floor(ticks)),c.now))
    else: schedule(k,body,NEVER)
@hook
def put(s,body,cell):
    at=cell*8
    m=s.cells[at+7]
    s.cells[at+m]=body
    s.cells[at+7]=m+1
    s.cell[body]=cell
    s.edges[body,0]=(cell%s.shape[0]-1)*s.side[0]
    s.edges[body,1]=(cell//s.shape[0]-1)*s.side[0]
@hook
def take(s,body):
    at=np.int64(s.cell[body])*8
    m=s.cells[at+7]-1
    i=at
    while s.cells[i]!=body: i+=1
    s.cells[i]=s.cells[at+m]
    s.cells[at+7]=m
def arrange(k,s):
    s.cells[:]=0
    p=positions_now(k)
    side=s.side[0]
    for body in range(len(p)):
        cx=int(math.floor(p[body,0]/side))+1; cy=int(math.floor(p[body,1]/side))+1
        cx=min(max(cx,1),s.shape[0]-2); cy=min(max(cy,1),s.shape[1]-2)
        put(s,body,cy*int(s.shape[0])+cx)
@hook
def build(k,s):
    for body in range(k.clock[0].bodies):
        watch(k,s,body)
@hook
def near(k,s,body):
    cell=np.int64(s.cell[body]); st=s.shape[0]
    m=0
    for row in range(-1,2):
        base=cell+row*st
        for step in range(-1,2):
            m=append(s.cells,(base+step)*8,k.near,m)
    return m
@hook
def repair(k,s,body):
    d=s.cross[body]; st=s.shape[0]
    move = -1 if d==0 else 1 if d==1 else -st if d==2 else st
    across = st if d<2 else 1
    take(s,body)
    cell=s.cell[body]+move
    put(s,body,cell)
    watch(k,s,body)
    m=append(s.cells,(cell+move-across)*8,k.near,0)
    m=append(s.cells,(cell+move)*8,k.near,m)
    return append(s.cells,(cell+move+across)*8,k.near,m)

class Cells:
    def prepare(self, scene):
        n=len(scene)
        R=2*float(scene.radius.max())*1.05
        import os; R=max(R,float(os.environ.get("SF","1"))*math.sqrt(scene.arena[0]*scene.arena[1]/n))
        nx=max(int(scene.arena[0]/R),1); side=scene.arena[0]/nx
        m=int(np.ceil(scene.arena[1]/side)); st=nx+2
        s=State(np.zeros(st*(m+2)*8,np.int32),np.zeros(n,np.int32),np.zeros(n,np.int32),np.array([st,m+2,0]),np.zeros((n,2)),np.array([side,0.]))
        return BroadPhaseParts(near=near,state=s,build=build,repair=repair,replan=watch,arrange=arrange)
