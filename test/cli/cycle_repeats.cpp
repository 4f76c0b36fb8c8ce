// Cycles of forces that do not repeat themselves: where the search begins nothing tells, on the way they act.
#include <catch2/catch.hpp>

#include "process.h"
#include "turning_disk.h"

using Catch::Contains;
using costate::test::Outcome;
using costate::test::run_costate;
using costate::test::turning_disk;
using costate::test::WorkingDirectory;
using costate::test::write_text;

namespace {

Outcome cycle_of(const std::string& couple, const std::string& more) {
  const WorkingDirectory here;
  write_text(here / "disk.toml", turning_disk("formula = \"" + couple + "\"", "0.1", more));
  return run_costate({"cycle", "disk.toml", "--no-files"}, here.path());
}

const std::string kForced = "-8*d.angle - 0.3*d.angle_dot + sin(pi*t)", kPeriod = "[cycle]\nperiod_s = 2\n";
const std::string kTurns =
    "[output.u]\nformula = \"sin(a)\"\nunit = \"1\"\na = \"d.angle\"\n[cycle]\nturns = [\"d.angle\"]\n"
    "section = { output = \"u\", above = 0.25 }\n";

}  // namespace

// What acts beyond 0.25 rad has no period of 2 s: the motion from what was told as its fixed point is at -0.388 rad
// after two periods, and never comes back (scipy).
TEST_CASE("cycle repeats: a force on the way has another period") {
  const Outcome right = cycle_of(kForced, kPeriod);
  CHECK(right.status == 0);
  const Outcome o = cycle_of(kForced + " + max(0, d.angle - 0.25)*5*sin(2.9*t)", kPeriod);
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("this is no period of theirs") && Contains("disk.toml"));
  // The second harmonic has.
  CHECK(cycle_of(kForced + " + max(0, d.angle - 0.25)*5*sin(2*pi*t)", kPeriod).status == 0);
}

// Beyond 15 rad the mean of the torque is 0.3 (angle - 15) more: an eigenvalue of 0.35 1/s, the motion runs away.
TEST_CASE("cycle repeats: a torque that grows from the third turn on") {
  CHECK(cycle_of("2 + cos(d.angle) - 0.5*d.angle_dot", kTurns).status == 0);
  for (const char* from : {"7", "15"}) {
    const Outcome o =
        cycle_of("2 + cos(d.angle) - 0.5*d.angle_dot + 0.3*max(0, d.angle - " + std::string(from) + ")", kTurns);
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("Something acts by the angle itself"));
  }
}

// At angle 0.1, where the search begins, nothing depends on time.
TEST_CASE("cycle repeats: a motion of its own period with a force of time on its way") {
  const std::string own = "-8*d.angle + 0.5*(1 - 4*d.angle^2)*d.angle_dot",
                    section = "[cycle]\nsection = { output = \"d.angle\", above = 0.1 }\nsettle = 12\n";
  CHECK(cycle_of(own, section).status == 0);
  const Outcome o = cycle_of(own + " + max(0, d.angle - 0.3)*0.05*sin(2.9*t)", section);
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("Give 'period_s' in the place of 'section'"));
}

// A torque c angle' takes exp(c T/(2 I)) of a disturbance a period T, by which the verdict of 1.0016 was "1 times".
TEST_CASE("cycle repeats: what hardly grows is told with its digits") {
  const Outcome o = cycle_of("-8*d.angle + 0.0016*d.angle_dot + sin(pi*t)", kPeriod);
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("NOT STABLE: a disturbance is 1.00160"));
}
