// A chain of uniform bars hanging from the ground, each joint tied to an anchor below by a damped spring; it starts
// straight at 45 degrees. Cost: the distance of its free end from where it started. Every bar brings two numbers that
// may be parameters: its mass and the natural length of the spring at its end.
#pragma once

#include "chain_facts.h"
#include "costate/problem/problem.h"

namespace costate::bench {

/// `parameters` at most 2 * bars: half of them masses, half natural lengths, spread evenly over the chain.
Problem make_chain(int bars, int parameters);

/// The same in space: rigid bodies on ball joints, along x at the start, the anchors in turn before and behind the
/// plane; the cost counts all three directions.
Problem make_spatial_chain(int bodies);
}  // namespace costate::bench
