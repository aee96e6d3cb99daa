"""Squares that do not rotate: exact ticks by ``enters``, and one component of each velocity is exchanged."""

import math

import kinetile as kt
from kinetile.errors import Refused
from kinetile.toolbox import NEVER, Kernel, PairParts, closing_speed, hook, shared
from kinetile.toolbox.ticks import difference_table, enters, plans_of, pointer


@hook
def meet(k: Kernel, a: int, b: int) -> int:
    early = a if k.bodies[a].anchor < k.bodies[b].anchor else b
    one, two = k.bodies[early], k.bodies[a + b - early]
    if math.isinf(k.mass[a]) and math.isinf(k.mass[b]):
        return NEVER
    at = int(k.numbers[1 + one.form * int(k.numbers[0]) + two.form])  # where their difference begins
    delay = enters(pointer(k.numbers), at, plans_of(k, one, two), 0, 0)
    return int(two.anchor + delay) if delay != NEVER else NEVER


@hook
def collide(k: Kernel, a: int, b: int) -> float:
    one, two = k.bodies[a], k.bodies[b]
    half, vx, vy = one.right + two.right, two.vx - one.vx, two.vy - one.vy
    nx, ny = -math.copysign(1.0, vx), -math.copysign(1.0, vy)  # of the two faces that come nearer
    x, y = nx * (two.x - one.x) - half, ny * (two.y - one.y) - half
    along_x = vx != 0.0 and (vy == 0.0 or x >= y)
    nx, ny = (nx, 0.0) if along_x else (0.0, ny)
    speed = closing_speed(one, two, nx, ny)
    one_share, two_share = shared(k.mass[a], k.mass[b], speed), shared(k.mass[b], k.mass[a], speed)
    one.vx, one.vy = one.vx + one_share * nx, one.vy + one_share * ny
    two.vx, two.vy = two.vx - two_share * nx, two.vy - two_share * ny
    return float(-x if along_x else -y)


class Squares:
    def prepare(self, scene: kt.Scene) -> PairParts:
        boxes = [i for i, shape in enumerate(scene.shapes) if shape.kind == "box"]
        if any(scene.shapes[i].core[2][0] != scene.shapes[i].core[2][1] for i in boxes):
            raise Refused("squares is for scenes in which all boxes are squares")
        numbers = difference_table(scene.shapes, ((i, j) for i in boxes for j in boxes))
        return PairParts(meet, collide, shapes=True, numbers=numbers)
