"""Boxes in layers, and arrows between them, as Sugiyama, Tagawa and Toda [1981] draw a graph: a layer for each box, empty
points where an arrow passes a layer, an order with few crossings, coordinates with straight arrows. The same for the same input."""

SWEEPS, SPACING_SWEEPS = 24, 1500
# How much an arrow pulls its ends together: both boxes; one of them an empty point; both empty points (it runs straight).
PULL = (1, 0.7, 20)
CENTRE_PULL = 0.2  # of each point: a drawing is narrow
GAP, GROUP_GAP, ARROW_GAP = 11, 22, 8  # between boxes, more between groups, beside arrows [px]
ROW_GAP, ROW_GAP_PER_ARROW = 16, 0.8  # between rows [px]


class Stacked:
    """Places boxes. All lengths in pixels; y grows downwards, the layers upwards.

    sizes: box -> (width, height). layer: box -> its layer, 0 the lowest. arrows: pairs of boxes of different layers, a pair
    once. group(box, layer): what stands together in a layer, in the order of these numbers.
    """

    def __init__(self, sizes, layer, arrows, group):
        self.layers = [[] for _ in range(max(layer.values()) + 1)]
        self.group, self.size, self.chains = {}, dict(sizes), {}
        self.above, self.below = {}, {}  # point -> points of the next layer it is linked with
        for box in sizes:
            self._add(box, layer[box], group(box, layer[box]))
        for arrow in sorted(arrows):
            upper, lower = sorted(arrow, key=layer.get, reverse=True)
            between = [(upper, lower, k) for k in range(layer[upper] - 1, layer[lower], -1)]
            for point in between:
                self.size[point] = (0, 0)
                self._add(point, point[2], group(upper, point[2]))
            self.chains[arrow] = [upper, *between, lower]
            for a, b in zip(self.chains[arrow], self.chains[arrow][1:]):
                self.below[a].append(b)
                self.above[b].append(a)
        self._order()
        self._place()

    def _add(self, point, layer, group):
        self.layers[layer].append(point)
        self.group[point] = group
        self.above[point], self.below[point] = [], []

    # ---- order

    def _order(self):
        """Sorts each layer by the mean place of neighbours in the layer before, upwards and downwards in turn."""
        best, fewest = None, None
        for sweep in range(SWEEPS):
            upward = sweep % 2 == 0
            count = len(self.layers)
            for k in range(1, count) if upward else range(count - 2, -1, -1):
                other = self.layers[k - 1 if upward else k + 1]
                links = self.below if upward else self.above
                place = {point: (i + 0.5) / len(other) for i, point in enumerate(other)}
                own = {point: (i + 0.5) / len(self.layers[k]) for i, point in enumerate(self.layers[k])}

                def middle(point):
                    ends = [place[end] for end in links[point]] or [own[point]]
                    return self.group[point], sum(ends) / len(ends)

                self.layers[k].sort(key=middle)
            self._swap_neighbours()
            crossings = self._crossings()
            if fewest is None or crossings < fewest:
                best, fewest = [layer[:] for layer in self.layers], crossings
        self.layers = best

    def _pair_crossings(self, p, q, place):
        """How many arrows of p and q cross when p stands on the left of q."""
        return sum(place[a] > place[b] for links in (self.above, self.below) for a in links[p] for b in links[q])

    def _crossings(self):
        place = {point: i for layer in self.layers for i, point in enumerate(layer)}
        pairs = ((p, q) for layer in self.layers for i, p in enumerate(layer) for q in layer[i + 1 :])
        return sum(place[a] > place[b] for p, q in pairs for a in self.above[p] for b in self.above[q])

    def _swap_neighbours(self):
        improved = True
        while improved:
            improved = False
            place = {point: i for layer in self.layers for i, point in enumerate(layer)}
            for layer in self.layers:
                for i in range(len(layer) - 1):
                    p, q = layer[i], layer[i + 1]
                    if self.group[p] != self.group[q] or self._pair_crossings(p, q, place) <= self._pair_crossings(q, p, place):
                        continue
                    layer[i], layer[i + 1], place[p], place[q] = q, p, i + 1, i
                    improved = True

    # ---- coordinates

    def _place(self):
        x = {}
        for layer in self.layers:
            x |= dict(zip(layer, self._offsets(layer)))
        for sweep in range(SPACING_SWEEPS):
            for layer in self.layers if sweep % 2 == 0 else self.layers[::-1]:
                self._space(layer, x)
        left = min(x[point] - self.size[point][0] / 2 for point in x)
        self.x = {point: x[point] - left for point in x}
        self.width = max(self.x[point] + self.size[point][0] / 2 for point in x)
        self.top, self.bottom, self.rows = {}, {}, []
        y = 0
        for layer in self.layers:
            height = max(self.size[point][1] for point in layer)
            self.rows.append((y - height, y))
            for point in layer:
                own = self.size[point][1] or height  # an arrow passes straight
                self.top[point], self.bottom[point] = y - (height + own) / 2, y - (height - own) / 2
            y -= height + ROW_GAP + ROW_GAP_PER_ARROW * sum(len(self.above[point]) for point in layer)
        self.height = -self.rows[-1][0]

    def path(self, arrow):
        """Points of an arrow from top to bottom, four for each gap between rows that it crosses: where it leaves what stands
        above, where it leaves that row, where it enters the next row, and where it meets what stands there."""
        row = {point: row for layer, row in zip(self.layers, self.rows) for point in layer}
        for p, q in zip(self.chains[arrow], self.chains[arrow][1:]):
            yield (self.x[p], self.bottom[p]), (self.x[p], row[p][1]), (self.x[q], row[q][0]), (self.x[q], self.top[q])

    def _offsets(self, layer):
        """The centres of points as near as they can stand, the first at 0."""
        offsets = [0]
        for p, q in zip(layer, layer[1:]):
            gap = GAP if self.size[p][0] and self.size[q][0] else ARROW_GAP
            gap += GROUP_GAP * (self.group[p] != self.group[q])
            offsets.append(offsets[-1] + (self.size[p][0] + self.size[q][0]) / 2 + gap)
        return offsets

    def _space(self, layer, x):
        """Moves points of a layer to the weighted mean of their neighbours and the centre, as near as order and sizes let them:
        least squares under lower bounds of distances, by pooling of adjacent violators."""
        offsets, centre = self._offsets(layer), sum(x.values()) / len(x)
        pools = []  # sum of weighted wishes, sum of weights, number of points
        for point, offset in zip(layer, offsets):
            pulls = [(centre, CENTRE_PULL)]
            for end in self.above[point] + self.below[point]:
                empty = (self.size[point][0] == 0) + (self.size[end][0] == 0)
                pulls.append((x[end], PULL[empty]))
            pools.append([sum((v - offset) * weight for v, weight in pulls), sum(weight for _, weight in pulls), 1])
            while len(pools) > 1 and pools[-2][0] / pools[-2][1] > pools[-1][0] / pools[-1][1]:
                last = pools.pop()
                pools[-1] = [a + b for a, b in zip(pools[-1], last)]
        bases = [total / weight for total, weight, count in pools for _ in range(count)]
        x.update((point, base + offset) for point, base, offset in zip(layer, bases, offsets))
