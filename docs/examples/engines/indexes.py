"""Spatial indexes of other libraries, for `kinetile conform --ask pairs`.

    python indexes.py strtree|rtree|ckdtree

`strtree` is shapely's packed tree of boxes and `rtree` libspatialindex's R-tree; both are rebuilt at each
moment, and a pair is two bodies whose boxes meet. `ckdtree` is SciPy's tree of points: a pair is two bodies
whose distances along x and y are at most the width of the widest box. Boxes are wider by a rounding, so
bodies that touch meet in the tree.
"""

import json
import math
import sys


def strtree(boxes):
    """Returns the pairs whose boxes meet."""
    import shapely

    shapes = [shapely.box(*box) for box in boxes]
    return shapely.STRtree(shapes).query(shapes).T.tolist()


def rtree(boxes):
    """Returns the pairs whose boxes meet."""
    from rtree.index import Index

    index = Index((n, box, None) for n, box in enumerate(boxes))
    return [(n, other) for n, box in enumerate(boxes) for other in index.intersection(box)]


def ckdtree(boxes):
    """Returns the pairs whose distances along x and y are at most the width of the widest box."""
    from scipy.spatial import cKDTree

    centres = [((left + right) / 2, (down + up) / 2) for left, down, right, up in boxes]
    widest = max(max(right - left, up - down) for left, down, right, up in boxes)
    far = max(max(map(abs, place)) for place in centres)
    return cKDTree(centres).query_pairs(widest + 4 * math.ulp(far + widest), p=math.inf)


def answer(line, pairs):
    """Returns the answer to a line."""
    if "moment" not in line:
        return {"refused": "it answers moments only"}
    named = {n: (x - r, y - r, x + r, y + r) for n, x, y, r in line.get("discs", ())}
    named = named or {n: box for n, *box in line.get("boxes", ())}
    numbers, boxes = [*named], []
    for left, down, right, up in named.values():
        low = (math.nextafter(each, -math.inf) for each in (left, down))
        boxes.append((*low, *(math.nextafter(each, math.inf) for each in (right, up))))
    found = pairs(boxes) if boxes else ()
    return {"pairs": [[numbers[a], numbers[b]] for a, b in found if a < b]}


chosen = {"strtree": strtree, "rtree": rtree, "ckdtree": ckdtree}[sys.argv[1]]
for text in sys.stdin:
    print(json.dumps(answer(json.loads(text), chosen)), flush=True)
