"""The broad phase of Box2D 2.3, a tree of enlarged boxes with a list of pairs, for `conform --ask pairs`.

    python box2d.py [sleepy]

A pair is two bodies with a contact; Box2D makes it as soon as their boxes in the tree meet. Box2D has single
precision and is made for bodies of about a metre: so a case is scaled, and distant bodies are refused. With
`sleepy` a body that rests from one moment to the next leaves the tree until it moves, a fault that the kit
must find.
"""

import json
import math
import sys

import Box2D

FARTHEST = 2.0**18  # rounding to single precision is below half of the .1 m margin of boxes


class World:
    """A world, and its bodies by number."""

    def __init__(self):
        self.world, self.bodies, self.scale = Box2D.b2World(gravity=(0, 0), doSleep=False), {}, None

    def answer(self, boxes, sleepy):
        """Updates the bodies, and returns the candidate pairs, or a refusal."""
        if self.scale is None and boxes:
            narrowest = min(max(right - left, up - down) for left, down, right, up in boxes.values())
            self.scale = 2.0 ** -math.floor(math.log2(narrowest)) if narrowest > 0 else 1.0
        boxes = {number: [self.scale * place for place in box] for number, box in boxes.items()}
        if any(abs(place) > FARTHEST for box in boxes.values() for place in box):
            return {"refused": "bodies are too far away for single precision"}
        for number in self.bodies.keys() - boxes.keys():
            self.world.DestroyBody(self.bodies.pop(number))
        come = boxes.keys() - self.bodies.keys()
        for number, (left, down, right, up) in boxes.items():
            place = (left + right) / 2, (down + up) / 2
            if number in come:
                shape = Box2D.b2PolygonShape(box=(max((right - left) / 2, 0.01), max((up - down) / 2, 0.01)))
                body = self.world.CreateDynamicBody(position=place, userData=number)
                body.CreateFixture(shape=shape)
                self.bodies[number] = body
            else:
                body = self.bodies[number]
                body.active = not sleepy or tuple(body.position) != place
                body.transform = place, 0.0
        self.world.contactManager.FindNewContacts()
        self.world.contactManager.Collide()
        contacts = self.world.contacts
        return {"pairs": [[c.fixtureA.body.userData, c.fixtureB.body.userData] for c in contacts]}


def answer(line, world, sleepy):
    """Returns the answer to a line."""
    if "moment" not in line:
        return {"refused": "it answers moments only"}
    if line["moment"] == 0:
        world.__init__()
    boxes = {n: (x - r, y - r, x + r, y + r) for n, x, y, r in line.get("discs", ())}
    return world.answer(boxes or {n: box for n, *box in line.get("boxes", ())}, sleepy)


world = World()
for text in sys.stdin:
    print(json.dumps(answer(json.loads(text), world, "sleepy" in sys.argv)), flush=True)
