"""A broad phase in plain Python for `kinetile conform --ask pairs`: sweep-and-prune, which keeps its order.

    python plain.py [FAULT]

FAULT is one of those below, which the kit must find.
"""

import json
import struct
import sys

FAULTS = {
    "single": "numbers are of single precision",
    "closed": "boxes that touch are apart",
    "gone": "a body that has gone stays where it was",
    "come": "of bodies that come the last is left out",
    "swap": "a body moves by one place in the order at each moment, and no farther",
}


def answer(line, order, place, fault):
    """Returns the candidate pairs of a moment, and updates the order of the bodies and their
    boxes."""
    if "moment" not in line:
        return {"refused": "it answers moments only"}
    if line["moment"] == 0:
        order.clear(), place.clear()
    if fault == "single":  # rounded boxes would still meet
        line["discs"] = [(n, *struct.unpack("3f", struct.pack("3f", *row))) for n, *row in line["discs"]]
    if "discs" in line:
        boxes = {n: (x - r, y - r, x + r, y + r) for n, x, y, r in line["discs"]}
    else:
        boxes = {n: tuple(box) for n, *box in line["boxes"]}
    order += [n for n in boxes if n not in place][: -1 if fault == "come" and line["moment"] else None]
    place |= boxes
    if fault != "gone":
        order[:] = [n for n in order if n in boxes]
    for at in range(1, len(order)):  # insertion sort: next to nothing has changed
        while at and place[order[at - 1]][0] > place[order[at]][0]:
            order[at - 1 : at + 1] = order[at], order[at - 1]
            at = 0 if fault == "swap" and line["moment"] else at - 1
    pairs = []
    for at, a in enumerate(order):
        for b in order[at + 1 :]:
            if place[b][0] > place[a][2]:
                break
            low, high = max(place[a][1], place[b][1]), min(place[a][3], place[b][3])
            if low < high or (low == high and fault != "closed"):
                pairs.append([a, b])
    return {"pairs": pairs}


order, place = [], {}
for text in sys.stdin:
    print(json.dumps(answer(json.loads(text), order, place, "".join(sys.argv[1:2]))), flush=True)
