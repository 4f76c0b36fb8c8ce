#!/usr/bin/env python3
"""The walker of arc_feet.toml on rigid ground: its gait, step time and multipliers, apart from Costate.

The stance arc rolls without slip on a plane that falls by one in a hundred; at heel strike the impulse acts at the
leading foot alone, which neither slides nor rebounds, and the trailing foot leaves. Runge and Kutta's method, the time of
the strike by halving, derivatives of the step by differences, the gait by Newton. Needs Python 3 and nothing else.
"""
import math

LEG, INERTIA, CENTRE, RADIUS, HIP, SLOPE = 0.5, 0.02, 0.5, 0.2, 1.0, 0.01
GRAVITY = (math.sin(SLOPE), -math.cos(SLOPE))  # along the plane, and against its normal


def solve(matrix, right):
    n = len(right)
    rows = [list(matrix[i]) + [right[i]] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(n):
            if k != i:
                factor = rows[k][i] / rows[i][i]
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i])]
    return [rows[i][n] / rows[i][i] for i in range(n)]


def directions(a, b):
    """Of the stance leg and the swing leg, upwards, and their derivatives."""
    return ((-math.sin(a), math.cos(a)), (-math.sin(b), math.cos(b)), (-math.cos(a), -math.sin(a)),
            (-math.cos(b), -math.sin(b)))


def masses(a, b):
    """(mass, Jacobian by the stance arc's centre and the angles, weights of the centripetal terms)."""
    _, _, da, db = directions(a, b)
    rest = CENTRE - 1
    return [(LEG, [[1, 0, CENTRE * da[0], 0], [0, 1, CENTRE * da[1], 0]], (CENTRE, 0)),
            (LEG, [[1, 0, da[0], rest * db[0]], [0, 1, da[1], rest * db[1]]], (1, rest)),
            (HIP, [[1, 0, da[0], 0], [0, 1, da[1], 0]], (1, 0))]


def mass_matrix(a, b):
    M = [[0.0] * 4 for _ in range(4)]
    for m, J, _ in masses(a, b):
        for row in J:
            for i in range(4):
                for j in range(4):
                    M[i][j] += m * row[i] * row[j]
    M[2][2] += INERTIA
    M[3][3] += INERTIA
    return M


ROLLING = [[-RADIUS, 0], [0, 0], [1, 0], [0, 1]]


def rates(s):
    a, b, va, vb = s
    ua, ub, _, _ = directions(a, b)
    M, Q = mass_matrix(a, b), [0.0] * 4
    for m, J, (ka, kb) in masses(a, b):
        for k in range(2):
            force = m * (GRAVITY[k] + ka * ua[k] * va * va + kb * ub[k] * vb * vb)
            for i in range(4):
                Q[i] += J[k][i] * force
    R = range(4)
    reduced = [[sum(ROLLING[i][p] * M[i][j] * ROLLING[j][q] for i in R for j in R) for q in range(2)] for p in range(2)]
    acceleration = solve(reduced, [sum(ROLLING[i][p] * Q[i] for i in R) for p in range(2)])
    return [va, vb] + acceleration


def advance(s, h):
    k1 = rates(s)
    k2 = rates([x + h / 2 * k for x, k in zip(s, k1)])
    k3 = rates([x + h / 2 * k for x, k in zip(s, k2)])
    k4 = rates([x + h * k for x, k in zip(s, k3)])
    return [x + h / 6 * (p + 2 * q + 2 * r + w) for x, p, q, r, w in zip(s, k1, k2, k3, k4)]


def swing(s, h=5e-4):
    """To the heel strike: the state there, and when."""
    t = 0.0
    height = lambda z: math.cos(z[0]) - math.cos(z[1])
    while True:
        n = advance(s, h)
        if t > 0.5 and height(s) > 0 >= height(n) and math.sin(n[1]) > math.sin(n[0]):
            break
        s, t = n, t + h
    low, high = 0.0, h
    for _ in range(60):
        middle = (low + high) / 2
        if height(advance(s, middle)) > 0:
            low = middle
        else:
            high = middle
    return advance(s, high), t + high


def impact(s):
    a, b, va, vb = s
    _, _, da, db = directions(a, b)
    M, v = mass_matrix(a, b), [-RADIUS * va, 0, va, vb]
    J = [[1, 0, da[0], RADIUS - db[0]], [0, 1, da[1], -db[1]]]  # of the leading foot where it touches
    A = [M[i] + [-J[0][i], -J[1][i]] for i in range(4)] + [J[k] + [0, 0] for k in range(2)]
    after = solve(A, [sum(M[i][j] * v[j] for j in range(4)) for i in range(4)] + [0, 0])
    return [b, a, after[3], after[2]]


def cross(r, v):
    return r[0] * v[1] - r[1] * v[0]


def moments(angles, rates, rolls):
    """Of momentum, of (trailing, leading) legs at a strike of which the one `rolls` stands: of the whole about the
    point where the leading foot touches, and of the trailing leg about the hip. The impulse acts at that point, and on
    the trailing leg at the hip: neither changes."""
    up, along = [(-math.sin(x), math.cos(x)) for x in angles], [(-math.cos(x), -math.sin(x)) for x in angles]
    hip, rest = (up[1][0], RADIUS + up[1][1]), CENTRE - 1
    speed = ((along[rolls][0] - RADIUS) * rates[rolls], along[rolls][1] * rates[rolls])
    places = [[h + rest * u for h, u in zip(hip, up[k])] for k in (0, 1)]
    speeds = [[v + rest * d * rates[k] for v, d in zip(speed, along[k])] for k in (0, 1)]
    turning = [INERTIA * w for w in rates]
    whole = HIP * cross(hip, speed) + sum(LEG * cross(places[k], speeds[k]) + turning[k] for k in (0, 1))
    return whole, LEG * cross([rest * u for u in up[0]], speeds[0]) + turning[0]


def show_moments(name, before, after):
    """State before the impact; leading and trailing rate behind it."""
    of_strike = moments(before[:2], before[2:], 0)
    behind = moments(before[:2], (after[1], after[0]), 1)
    print("%s: moments %.12f, %.9f at the strike, %.12f, %.9f behind it" % ((name,) + of_strike + behind))


def step(x):
    """x: stance angle (the swing leg's is its mirror image), stance rate, swing rate, behind an impact."""
    strike, t = swing([x[0], -x[0], x[1], x[2]])
    behind = impact(strike)
    return [behind[0], behind[2], behind[3]], t


def jacobian(x, d=1e-5):
    columns = []
    for j in range(3):
        up, down = x[:], x[:]
        up[j] += d
        down[j] -= d
        columns.append([(p - q) / (2 * d) for p, q in zip(step(up)[0], step(down)[0])])
    return [[columns[j][i] for j in range(3)] for i in range(3)]


def eigenvalues(A):
    trace = sum(A[i][i] for i in range(3))
    minors = sum(A[i][i] * A[j][j] - A[i][j] * A[j][i] for i in range(3) for j in range(i))
    det = sum(A[0][i] * (A[1][(i + 1) % 3] * A[2][(i + 2) % 3] - A[1][(i + 2) % 3] * A[2][(i + 1) % 3])
              for i in range(3))
    z = [1 + 0j, 0.4 + 0.9j, -0.65 + 0.72j]
    for _ in range(200):
        for i in range(3):
            others = [z[k] for k in range(3) if k != i]
            z[i] -= (z[i]**3 - trace * z[i]**2 + minors * z[i] - det) / ((z[i] - others[0]) * (z[i] - others[1]))
    return z


x = [0.19, -0.239, -0.187]
for _ in range(5):
    P, t = step(x)
    A = jacobian(x)
    dx = solve([[(i == j) - A[i][j] for j in range(3)] for i in range(3)], [p - q for p, q in zip(P, x)])
    x = [p + q for p, q in zip(x, dx)]
print("step time %.10f" % step(x)[1])
print("stance angle %.10f, rate %.10f, swing rate %.10f" % tuple(x))
for m in eigenvalues(jacobian(x)):
    print("multiplier %.7f %+.7f i" % (m.real, m.imag))
show_moments("this gait", swing([x[0], -x[0], x[1], x[2]])[0], x[1:])
# An earlier figure: the legs strike where it says and when, and its moments do not agree.
x = [0.189472782205104, -0.239124222551699, -0.239124222551699 + 0.053691703909393]
strike, t = swing([x[0], -x[0], x[1], x[2]])
print("earlier figure: from its state the strike is at %.9f s and %.12f" % (t, strike[1]))
show_moments("earlier figure", strike, x[1:])
