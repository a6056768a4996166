"""Acc once more, in thirty lines that share nothing with the program: lists, loops and the paper's equation 6."""


def acc(rotation, translation, matrix, distortion, frames, scans, half_period_ns):
    """Return Acc in percent.

    Args:
        rotation: of camera_from_radar, rows.
        translation: of it [m].
        matrix: (fx, fy, cx, cy).
        distortion: (k1, k2, p1, p2).
        frames: (stamp, {object: (left, top, right, bottom)}) of each annotated frame.
        scans: (stamp, [(x, y, z, object)]) of each scan; "" is no object.
        half_period_ns: longest time between a frame and its scan.
    """
    (fx, fy, cx, cy), (k1, k2, p1, p2) = matrix, distortion
    shares = []
    for stamp, boxes in frames:
        nearest = min(scans, key=lambda scan: (abs(scan[0] - stamp), scan[0]))
        if abs(nearest[0] - stamp) > half_period_ns:
            continue
        inside = []
        for x, y, z, name in nearest[1]:
            if name not in boxes:
                continue
            a, b, c = (row[0] * x + row[1] * y + row[2] * z + t for row, t in zip(rotation, translation, strict=True))
            u, v = a / c, b / c
            rr = u * u + v * v
            radial = 1 + k1 * rr + k2 * rr * rr
            column = fx * (u * radial + 2 * p1 * u * v + p2 * (rr + 2 * u * u)) + cx
            row = fy * (v * radial + p1 * (rr + 2 * v * v) + 2 * p2 * u * v) + cy
            left, top, right, bottom = boxes[name]
            inside.append(c > 0 and left <= column <= right and top <= row <= bottom)
        if inside:
            shares.append(sum(inside) / len(inside))
    return 100.0 * sum(shares) / len(shares)
