// The five-bar's numbers through the command line, and what selects and changes them.
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::kGradient;
using costate::test::kPsi;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

namespace {

Json gradient(const std::vector<std::string>& options) {
  const WorkingDirectory here;
  std::vector<std::string> arguments = {"gradient", kFiveBar, "--no-files"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return costate_json(arguments, here.path());
}

void check_close(const Json& j, double relative) {
  CHECK(j.at("psi").get<double>() == Approx(kPsi).epsilon(relative));
  for (const auto& [name, value] : j.at("gradient").items()) {
    INFO(name);
    CHECK(value.get<double>() == Approx(kGradient.at(name)).epsilon(relative));
  }
}

}  // namespace

TEST_CASE("five-bar: psi and gradient by every method of the interface at rtol 1e-9") {
  for (const std::string formulation : {"index1", "index2", "baumgarte", "penalty"})
    for (const std::string method :
         {"idas-forward", "idas-adjoint", "cvodes-forward", "cvodes-adjoint", "differences"}) {
      if (formulation == "index2" && method.rfind("cvodes", 0) == 0) continue;
      INFO(formulation << " x " << method);
      const Json j = gradient({"--formulation", formulation, "--method", method, "--rtol", "1e-9"});
      CHECK(j.at("formulation") == formulation);
      CHECK(j.at("method") == method);
      CHECK(j.at("rtol") == 1e-9);
      if (method != "differences") CHECK(method.rfind(j.at("integrator").get<std::string>(), 0) == 0);
      check_close(j, 1e-6);
    }
}

TEST_CASE("five-bar: all eight parameters") {
  const Json j = gradient({"--parameters", "L01,L02,k1,k2,m1,m2,m3,m4", "--rtol", "1e-10"});
  CHECK(j.at("gradient").size() == 8);
  check_close(j, 1e-6);
}

TEST_CASE("option --parameters: order, single ones, and numbers by their path") {
  CHECK(gradient({"--parameters", "k2"}).at("gradient").size() == 1);
  CHECK(gradient({"--parameters", "k2", "--parameters", "m1"}).at("gradient").size() == 2);
  const Json by_path = gradient({"--parameters", "m3,spring.S1.stiffness_N_per_m", "--rtol", "1e-10"});
  CHECK(by_path.at("gradient").at("spring.S1.stiffness_N_per_m").get<double>() ==
        Approx(kGradient.at("k1")).epsilon(1e-6));
  CHECK(by_path.at("gradient").at("m3").get<double>() == Approx(kGradient.at("m3")).epsilon(1e-6));
  CHECK(by_path.at("parameters").at("spring.S1.stiffness_N_per_m") == 100);
  // A number that no parameter of the scene names, in every method: a bar's length moves the start.
  const Json adjoint = gradient({"--parameters", "bar.A1.length_m,gravity.y_m_per_s2", "--rtol", "1e-10"});
  const Json oracle = gradient({"--parameters", "bar.A1.length_m,gravity.y_m_per_s2", "--method", "differences"});
  for (const auto& [name, value] : oracle.at("gradient").items())
    CHECK(adjoint.at("gradient").at(name).get<double>() == Approx(value.get<double>()).epsilon(1e-6));
  // d(psi)/d(g) of the same independent program, for g pointing down.
  CHECK(adjoint.at("gradient").at("gravity.y_m_per_s2").get<double>() == Approx(-0.12779738437303844).epsilon(1e-6));
}

TEST_CASE("options may stand before the scene") {
  const WorkingDirectory here;
  const Json j = costate_json({"gradient", "--parameters", "L01", "--set", "run.t_end_s=1", kFiveBar}, here.path());
  CHECK(j.at("gradient").size() == 1);
  CHECK(costate_json({"check", "--formulations", "index1", "--methods", "cvodes-forward", "--no-files", kFiveBar},
                     here.path())
            .at("rows")
            .size() == 1);
}

TEST_CASE("option --set: values of the scene from the command line") {
  // The reference after one second.
  const Json one_second = gradient({"--set", "run.t_end_s=1", "--rtol", "1e-10"});
  CHECK(one_second.at("psi").get<double>() == Approx(0.1144363741763615).epsilon(1e-7));
  CHECK(one_second.at("gradient").at("L01").get<double>() == Approx(-0.6256097321493312).epsilon(1e-6));
  Json by_option = gradient({"--t-end", "1", "--rtol", "1e-10"});
  by_option["wall_s"] = one_second.at("wall_s");
  CHECK(by_option == one_second);

  const Json changed = gradient({"--set", "spring.S1.natural_length_m=2.4", "--set", "run.method=idas-forward", "--set",
                                 "run.parameters=['k1']", "--set", "formulation.baumgarte_xi=0.7"});
  CHECK(changed.at("method") == "idas-forward");
  CHECK(changed.at("gradient").size() == 1);
  CHECK(changed.at("settings").at("baumgarte_xi") == 0.7);
  CHECK(gradient({"--set", "spring.S1.natural_length_m=2.4"}).at("parameters").at("L01") == 2.4);
  CHECK(gradient({"--set", "cost.running[0].weight=2", "--set", "cost.running[1].weight=2"}).at("psi").get<double>() ==
        Approx(2 * kPsi).epsilon(1e-6));
}

TEST_CASE("the corrector of forward sensitivities can be chosen") {
  const auto run = [](const char* corrector) {
    return gradient({"--method", "idas-forward", "--rtol", "1e-9", "--sensitivity-corrector", corrector});
  };
  const Json staggered = run("staggered"), simultaneous = run("simultaneous");
  CHECK(simultaneous.at("settings").at("sensitivity_corrector") == "simultaneous");
  // Two different runs of one tolerance: not the same number, but close.
  CHECK(staggered.at("counters") != simultaneous.at("counters"));
  for (const char* name : {"L01", "L02"})
    CHECK(simultaneous.at("gradient").at(name).get<double>() ==
          Approx(staggered.at("gradient").at(name).get<double>()).epsilon(1e-6));
}

TEST_CASE("options win over the scene") {
  const Json j = gradient({"--set", "run.rtol=1e-5", "--set", "run.formulation=penalty", "--formulation", "baumgarte",
                           "--method", "cvodes-adjoint", "--rtol", "1e-7", "--atol", "1e-9", "--cvodes-method", "bdf",
                           "--penalty-alpha", "1e5", "--checkpoint-steps", "50"});
  CHECK(j.at("formulation") == "baumgarte");
  CHECK(j.at("rtol") == 1e-7);
  CHECK(j.at("settings").at("atol") == 1e-9);
  CHECK(j.at("settings").at("cvodes_method") == "bdf");
  CHECK(j.at("settings").at("penalty_alpha") == 1e5);
  CHECK(j.at("settings").at("checkpoint_steps") == 50);
}
