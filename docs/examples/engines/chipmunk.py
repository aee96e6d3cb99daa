"""Chipmunk's broad phase, a tree of boxes, through pymunk, for `kinetile conform --ask pairs`.

    python chipmunk.py [stale]

A pair is two bodies whose boxes meet in the tree. With `stale` a body that has moved by less than its radius
keeps its place in the tree, a fault that the kit must find.
"""

import json
import sys

import pymunk


class World:
    """A space, and its shapes by the number of the body."""

    def __init__(self):
        self.space, self.shapes = pymunk.Space(), {}

    def pairs(self, discs, stale):
        """Updates the discs, and returns the candidate pairs."""
        for number in self.shapes.keys() - discs.keys():
            shape = self.shapes.pop(number)
            self.space.remove(shape, shape.body)
        for number, (x, y, radius) in discs.items():
            if number not in self.shapes:
                body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
                body.position = x, y
                self.shapes[number] = pymunk.Circle(body, radius)
                self.space.add(body, self.shapes[number])
                continue
            shape = self.shapes[number]
            if not stale or shape.body.position.get_distance((x, y)) >= radius:
                shape.body.position = x, y
                self.space.reindex_shape(shape)
        numbers = {shape: number for number, shape in self.shapes.items()}
        near = {n: self.space.bb_query(s.bb, pymunk.ShapeFilter()) for s, n in numbers.items()}
        return [[n, numbers[other]] for n in near for other in near[n] if n < numbers[other]]


def answer(line, world, stale):
    """Returns the answer to a line."""
    if "discs" not in line:
        return {"refused": "it answers moments of discs only"}
    if line["moment"] == 0:
        world.__init__()
    return {"pairs": world.pairs({number: disc for number, *disc in line["discs"]}, stale)}


world = World()
for text in sys.stdin:
    print(json.dumps(answer(json.loads(text), world, "stale" in sys.argv)), flush=True)
