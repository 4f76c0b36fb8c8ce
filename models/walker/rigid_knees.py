"""The gait of knees.toml on rigid ground, by a program apart from Costate: five point masses, the foot of the stance leg
fixed, knees that lock and heels that strike by plastic impacts, DOP853 between them, Newton's method for the gait.
Coordinates: the foot (x, y), then the angles of stance shank, stance thigh, swing thigh and swing shank, against the
vertical. Needs numpy and scipy. Prints the step's time, when the knee locks, the state and the multipliers."""
import numpy as np
from scipy.integrate import solve_ivp

G, SLOPE = 9.81, 0.0504
HIP, THIGH, SHANK = 0.5, 0.5, 0.05  # masses
HALF, SHANK_UP, THIGH_UP = 0.5, 0.375, 0.175  # length of either half of a leg, masses above its lower end


def chain(angles, links):
    """The end of links (which angle, how far up) from the foot: position and its Jacobian."""
    p, J = np.zeros(2), np.eye(2, 6)
    for i, length in links:
        p = p + length * np.array([-np.sin(angles[i]), np.cos(angles[i])])
        J[:, 2 + i] += length * np.array([-np.cos(angles[i]), -np.sin(angles[i])])
    return p, J


UP = [(0, HALF), (1, HALF)]
POINTS = [(SHANK, [(0, SHANK_UP)]), (THIGH, [(0, HALF), (1, THIGH_UP)]), (HIP, UP), (THIGH, UP + [(2, THIGH_UP - HALF)]),
          (SHANK, UP + [(2, -HALF), (3, SHANK_UP - HALF)])]
FOOT = UP + [(2, -HALF), (3, -HALF)]
STANCE = np.array([[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 1, -1, 0, 0]], float)
SWING_KNEE = np.array([[0, 0, 0, 0, 1, -1]], float)


def mass_and_force(th, w):
    M, Q = np.zeros((6, 6)), np.zeros(6)
    for m, links in POINTS:
        _, J = chain(th, links)
        centripetal = sum(length * w[i] ** 2 * np.array([np.sin(th[i]), -np.cos(th[i])]) for i, length in links)
        M += m * J.T @ J
        Q += m * J.T @ (np.array([0, -G]) - centripetal)
    return M, Q


def constrained(M, right, C):
    n = len(C)
    return np.linalg.solve(np.block([[M, C.T], [C, np.zeros((n, n))]]), np.concatenate([right, np.zeros(n)]))[:6]


def fly(y, t, C, event):
    event.terminal = True
    rates = lambda t, y: np.concatenate([y[4:], constrained(*mass_and_force(y[:4], y[4:]), C)[2:]])
    s = solve_ivp(rates, (t, t + 2), y, rtol=1e-11, atol=1e-12, method="DOP853", events=event, max_step=0.02)
    return s.y[:, -1], s.t[-1]


def strike(y, C):
    M, _ = mass_and_force(y[:4], np.zeros(4))
    return np.concatenate([y[:4], constrained(M, M @ np.concatenate([[0, 0], y[4:]]), C)[2:]])


def step(x):
    """From behind a heel strike to behind the next one: x = (stance angle, rates of stance leg, thigh, shank)."""
    swing = -2 * SLOPE - x[0]
    straight = lambda t, y: y[3] - y[2] if t > 0.05 else -1.0
    straight.direction = 1
    y, knee = fly(np.array([x[0], x[0], swing, swing, x[1], x[1], x[2], x[3]]), 0, STANCE, straight)
    lands = lambda t, y: (lambda p: p[1] * np.cos(SLOPE) + p[0] * np.sin(SLOPE) if p[0] > 0.1 else 1.0)(chain(y[:4], FOOT)[0])
    lands.direction = -1
    y, end = fly(strike(y, np.vstack([STANCE, SWING_KNEE])), knee, np.vstack([STANCE, SWING_KNEE]), lands)
    y = strike(y, np.vstack([chain(y[:4], FOOT)[1], SWING_KNEE]))
    return np.array([y[2], y[6], y[5], y[4]]), end, knee


def main():
    x, D, h = np.array([0.187, -1.13, 0.06, -3.7]), np.zeros((4, 4)), 1e-5
    for _ in range(8):
        for j, e in enumerate(h * np.eye(4)):
            D[:, j] = (step(x + e)[0] - step(x - e)[0]) / (2 * h)
        dx = np.linalg.solve(np.eye(4) - D, step(x)[0] - x)
        x = x + dx
        if abs(dx).max() < 1e-10:
            break
    _, end, knee = step(x)
    print(f"step {end:.9f} s, knee locks at {knee:.9f} s, state {x}, multipliers {np.linalg.eigvals(D)}")


if __name__ == "__main__":
    main()
