// Where derivative blocks jump along a stored motion, to a billionth of its span. The motion is a polynomial on each of
// the integrator's steps, so that whatever is not smooth within a step is the blocks' own: nobody has to declare it.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace costate {

/// Two instants with a jump between them, and so near that nothing else happens there: by `sides` of the span beyond
/// those between which it is known to be.
struct BlockJump {
  double before, after, last_before, first_after;
};

struct BlockJumps {
  std::vector<BlockJump> all;  // in order
  /// Where blocks are rough: more jumps than can be told from rounding. `all` is empty then.
  std::optional<double> rough;
};

/// The blocks at t, one behind the other, and where each ends.
using BlocksAt = std::function<void(double t, std::vector<double>& values, std::vector<std::size_t>& ends)>;

/// Of the span: to what a jump's time is found, and by how much its two sides are farther apart than that, so that both
/// can stand in a grid; jumps nearer to each other are one.
struct JumpSearch {
  double resolution = 1e-12, sides = 2e-9;
};

/// `times`: the ends of the motion's steps in order, two at least. Jumps count from 1e-6 of an entry's largest value
/// along the motion on.
BlockJumps find_block_jumps(const std::vector<double>& times, const BlocksAt& blocks, const JumpSearch& search = {});

}  // namespace costate
