// How memory and work grow with the number of parameters and elements.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "process.h"

using costate::test::Outcome;
using costate::test::Process;
using costate::test::WorkingDirectory;
using costate::test::write_text;

namespace {

/// A row of bars, each with its mass as a parameter.
std::string chain(int bars) {
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\n", given, names;
  for (int i = 1; i <= bars; ++i) {
    text += fmt::format("[point.P{}]\nx_m = {}\ny_m = {}\n", i, 0.06 * i, -0.08 * i);
    text += fmt::format("[bar.b{0}]\nfrom = \"P{1}\"\nto = \"P{0}\"\nlength_m = 0.1\nmass_kg = 1\n", i, i - 1);
    text += fmt::format("[parameter.m{0}]\nnumber = \"bar.b{0}.mass_kg\"\n", i);
    given += fmt::format("\"P{}.x\", ", i);
    names += fmt::format("\"m{}\", ", i);
  }
  return text + "[start]\ngiven = [" + given +
         "]\n[[cost.running]]\nkind = \"square\"\noutput = \"P1.y\"\n[run]\nt_end_s = " + "1e-5\nparameters = [" +
         names + "]\n";
}

/// Masses that fall, each a parameter.
std::string falling(int masses) {
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n";
  for (int i = 0; i < masses; ++i)
    text += fmt::format(
        "[point.P{0}]\nx_m = {0}\ny_m = 0\n[mass.m{0}]\npoint = \"P{0}\"\nmass_kg = 1\n"
        "[parameter.p{0}]\nnumber = \"mass.m{0}.mass_kg\"\n",
        i);
  return text;
}

}  // namespace

#if !defined(__SANITIZE_ADDRESS__)
// With dense derivatives of the start, 3,000 masses needed 1.6 GB.
TEST_CASE("the memory of an adjoint gradient is not that of mechanism times parameters") {
  const WorkingDirectory here;
  write_text(here / "chain.toml", chain(2000));
  for (const std::string method :
       {"--formulation baumgarte --method cvodes-adjoint", "--formulation index1 --method idas-adjoint",
        "--formulation index3 --method discrete-adjoint --step 1e-6"}) {
    INFO(method);
    const Outcome o =
        Process(
            "/bin/sh",
            {"-c", "ulimit -v 700000; exec '" COSTATE_EXECUTABLE "' gradient chain.toml --no-files --json " + method},
            here.path())
            .finish();
    INFO(o.err);
    CHECK(o.status == 0);
    CHECK(costate::test::one_object(o.out).at("gradient").size() == 2000);
  }
}

// Quadratic work would be 100 s of the processor or more for each: 2e5 coordinates that are looked through for every
// one that is given, 3e5 keys of an object for every one that is added. Linear, it is some 5 s.
TEST_CASE("large scenes are read, listed and written in linear time") {
  const WorkingDirectory here;
  write_text(here / "falling.toml", falling(80000));
  for (const std::string command : {"dump falling.toml", "list falling.toml --json"}) {
    INFO(command);
    const Outcome o =
        Process("/bin/sh", {"-c", "ulimit -t 30; exec '" COSTATE_EXECUTABLE "' " + command + " > out"}, here.path())
            .finish();
    INFO(o.err);
    CHECK(o.status == 0);
  }
}
#endif
