// A small importer of FMUs, written from the text of FMI 3.0 and without anything of Costate's: unpacks the file, reads
// its description, loads its library, and runs it both ways. What it finds is printed as JSON.
//   fmu_importer FILE.fmu FOLDER STEPS [NAME=VALUE ...]
// with STEPS of the method that it exchanges models with; 0: none, only co-simulation.
#include <dlfcn.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "fmu_file.h"

namespace {

using namespace fmu;
using Json = nlohmann::json;
using Numbers = std::vector<double>;

void log_message(void* said, int, const char*, const char* message) {
  static_cast<std::vector<std::string>*>(said)->push_back(message);
}

/// The library of an FMU.
struct Library {
  explicit Library(const fs::path& path) : handle(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (!handle) fail(dlerror());
  }
  template <class Function>
  Function* get(const char* name) const {
    void* f = dlsym(handle, name);
    if (!f) fail(std::string("the library has no ") + name);
    return reinterpret_cast<Function*>(f);
  }
  void* handle;
};

/// One instance; every status that is not OK ends the program.
class Fmu {
 public:
  Fmu(const Library& library, const Description& d, const fs::path& folder, bool exchange) : library_(library) {
    const std::string token = d.model.at("instantiationToken"), resources = (folder / "resources/").string();
    if (exchange)
      me_ = library.get<void*(const char*, const char*, const char*, bool, bool, void*, void*)>(
          "fmi3InstantiateModelExchange")("one", token.c_str(), resources.c_str(), false, false, &said,
                                          reinterpret_cast<void*>(&log_message));
    else
      me_ = library.get<void*(const char*, const char*, const char*, bool, bool, bool, bool, const std::uint32_t*,
                              std::size_t, void*, void*, void*)>("fmi3InstantiateCoSimulation")(
          "one", token.c_str(), resources.c_str(), false, false, false, false, nullptr, 0, &said,
          reinterpret_cast<void*>(&log_message), nullptr);
    if (!me_) fail("no instance: " + (said.empty() ? "" : said.back()));
  }
  ~Fmu() { library_.get<void(void*)>("fmi3FreeInstance")(me_); }
  Fmu(const Fmu&) = delete;
  Fmu& operator=(const Fmu&) = delete;

  template <class... Arguments>
  int status(const char* function, Arguments... arguments) {
    return library_.get<int(void*, Arguments...)>(function)(me_, arguments...);
  }
  template <class... Arguments>
  void call(const char* function, Arguments... arguments) {
    if (status(function, arguments...) != 0) fail(std::string(function) + ": " + (said.empty() ? "" : said.back()));
  }
  Numbers get(const References& r) {
    Numbers x(r.size());
    call("fmi3GetFloat64", r.data(), r.size(), x.data(), x.size());
    return x;
  }
  void set(const References& r, const Numbers& x) { call("fmi3SetFloat64", r.data(), r.size(), x.data(), x.size()); }
  Numbers product(const char* function, const References& unknowns, const References& knowns, const Numbers& seed) {
    const bool adjoint = std::string(function) == "fmi3GetAdjointDerivative";
    Numbers r(adjoint ? knowns.size() : unknowns.size());
    call(function, unknowns.data(), unknowns.size(), knowns.data(), knowns.size(), seed.data(), seed.size(), r.data(),
         r.size());
    return r;
  }
  void initialize(double start, double stop) { call("fmi3EnterInitializationMode", false, 0.0, start, true, stop); }

  std::vector<std::string> said;

 private:
  const Library& library_;
  void* me_;
};

Numbers combined(const Numbers& x, double h, const Numbers& d) {
  Numbers r = x;
  for (std::size_t i = 0; i < x.size(); ++i) r[i] += h * d[i];
  return r;
}
double dot(const Numbers& a, const Numbers& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}
double size_of(const Numbers& a) { return std::sqrt(dot(a, a)); }

class Importer {
 public:
  Importer(const fs::path& folder, const std::map<std::string, double>& values)
      : folder_(folder),
        d_(bytes_of(folder / "modelDescription.xml")),
        library_(fs::directory_iterator(folder / "binaries")->path() / (d_.simulation.at("modelIdentifier") + ".so")),
        values_(values) {
    start_ = std::stod(d_.experiment.at("startTime"));
    stop_ = std::stod(d_.experiment.at("stopTime"));
  }

  Json run(long steps) {
    Json j;
    j["version"] = library_.get<const char*()>("fmi3GetVersion")();
    j["exchange"] = !d_.exchange.empty();
    if (!d_.exchange.empty() && steps > 0) {
      j["exchanged"] = named(d_.outputs, exchanged(steps));
      j["exchanged_coarse"] = named(d_.outputs, exchanged(steps / 2));
      j["states"] = d_.states.size();
      j["jumps"] = jumps_;
      derivatives(j);
    }
    simulated(j);
    j["refused"] = refused();
    // Costate's own libraries are those of the FMU.
    j["from_elsewhere"] = Json::array();
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);)
      if (const auto at = line.find('/'); at != std::string::npos)
        if (const std::string path = line.substr(at); fs::path(path).filename().string().rfind("libcostate", 0) == 0 &&
                                                      path.rfind(fs::canonical(folder_).string(), 0) != 0)
          j["from_elsewhere"].push_back(path);
    return j;
  }

 private:
  Json named(const References& r, const Numbers& x) const {
    Json j = Json::object();
    for (std::size_t i = 0; i < x.size(); ++i) j[d_.of(r[i]).at("name")] = x[i];
    return j;
  }
  void set_parameters(Fmu& fmu) const {
    for (const auto& [name, value] : values_)
      for (const std::uint32_t p : d_.parameters)
        if (d_.of(p).at("name") == "parameter." + name) fmu.set({p}, {value});
  }

  /// Event mode up to continuous time; the time of the next event.
  double events(Fmu& fmu) {
    bool again = true, end = false, nominals = false, changed = false, defined = false;
    double next = 0;
    while (again) {
      fmu.call("fmi3UpdateDiscreteStates", &again, &end, &nominals, &changed, &defined, &next);
      jumps_ += changed ? 1 : 0;
    }
    fmu.call("fmi3EnterContinuousTimeMode");
    return defined ? next : std::numeric_limits<double>::infinity();
  }

  /// The classical Runge-Kutta method, from event to event.
  Numbers exchanged(long steps) {
    Fmu fmu(library_, d_, folder_, true);
    set_parameters(fmu);
    fmu.initialize(start_, stop_);
    fmu.call("fmi3ExitInitializationMode");
    jumps_ = 0;
    double t = start_, next = events(fmu);
    const std::size_t n = d_.states.size();
    Numbers y(n);
    while (t < stop_) {
      fmu.call("fmi3GetContinuousStates", y.data(), n);
      const double to = std::min(next, stop_);
      const long count = std::max(1L, std::lround(static_cast<double>(steps) * (to - t) / (stop_ - start_)));
      const double h = (to - t) / static_cast<double>(count), from = t;
      const auto f = [&](double at, const Numbers& x) {
        Numbers r(n);
        fmu.call("fmi3SetTime", at);
        fmu.call("fmi3SetContinuousStates", x.data(), n);
        fmu.call("fmi3GetContinuousStateDerivatives", r.data(), n);
        return r;
      };
      for (long i = 0; i < count; ++i) {
        t = from + static_cast<double>(i) * h;
        const double end = i + 1 == count ? to : t + h;
        const Numbers a = f(t, y), b = f(t + h / 2, combined(y, h / 2, a)), c = f(t + h / 2, combined(y, h / 2, b)),
                      e = f(end, combined(y, h, c));
        for (std::size_t k = 0; k < n; ++k) y[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + e[k]);
        fmu.call("fmi3SetTime", end);
        fmu.call("fmi3SetContinuousStates", y.data(), n);
        bool enter = false, terminate = false;
        fmu.call("fmi3CompletedIntegratorStep", true, &enter, &terminate);
      }
      t = to;
      if (t < stop_) {
        fmu.call("fmi3EnterEventMode");
        next = events(fmu);
      }
    }
    return fmu.get(d_.outputs);
  }

  /// Co-simulation: the states' derivatives at its start, these and the outputs at its end.
  void simulated(Json& j) {
    Fmu fmu(library_, d_, folder_, false);
    set_parameters(fmu);
    fmu.initialize(start_, stop_);
    j["rates_first"] = named(d_.derivatives, fmu.get(d_.derivatives));
    fmu.call("fmi3ExitInitializationMode");
    bool events = false, end = false, early = false;
    double t = start_;
    for (int i = 1; i <= 17; ++i) {
      const double to = start_ + (stop_ - start_) * i / 17;
      fmu.call("fmi3DoStep", t, to - t, true, &events, &end, &early, &t);
    }
    j["simulated"] = named(d_.outputs, fmu.get(d_.outputs));
    j["rates"] = named(d_.derivatives, fmu.get(d_.derivatives));
  }

  /// What is wrong fails, with a sentence.
  std::vector<std::string> refused() {
    std::vector<std::string> said;
    const auto attempt = [&](const std::function<void()>& wrong) {
      try {
        wrong();
        said.emplace_back("nothing");
      } catch (const std::exception& e) {
        said.emplace_back(e.what());
      }
    };
    attempt([&] {
      Description other = d_;
      other.model["instantiationToken"] = "another";
      Fmu(library_, other, folder_, false);
    });
    Fmu fmu(library_, d_, folder_, false);
    attempt([&] { fmu.get({100000}); });
    attempt([&] { fmu.get({d_.states[0]}); });
    bool events = false, end = false, early = false;
    double t = start_;
    const auto step = [&](double from, double size) {
      fmu.call("fmi3DoStep", from, size, true, &events, &end, &early, &t);
    };
    attempt([&] { step(start_, 0.1); });
    fmu.initialize(start_, stop_);
    attempt([&] { fmu.set({d_.states[0]}, {1}); });
    fmu.call("fmi3ExitInitializationMode");
    attempt([&] { step(start_ + 1, 0.1); });
    attempt([&] { step(start_, 2 * (stop_ - start_)); });
    return said;
  }

  /// Products with random seeds, against each other and against central differences.
  void derivatives(Json& j) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    const auto seed = [&](std::size_t n) {
      Numbers x(n);
      for (double& v : x) v = normal(random);
      return x;
    };
    References unknowns = d_.derivatives;
    unknowns.insert(unknowns.end(), d_.outputs.begin(), d_.outputs.end());
    const auto compare = [&](const char* name, const Numbers& forward, const Numbers& u, const Numbers& v,
                             const Numbers& backward, const Numbers& differences) {
      j[name] = {{"forward", dot(v, forward)},
                 {"backward", dot(u, backward)},
                 {"scale", size_of(v) * size_of(forward)},
                 {"off", size_of(combined(forward, -1, differences)) / (size_of(forward) + 1e-300)}};
    };
    // In continuous time by the states, at a state that the run comes through.
    {
      Fmu fmu(library_, d_, folder_, true);
      fmu.initialize(start_, stop_);
      fmu.call("fmi3ExitInitializationMode");
      events(fmu);
      const std::size_t n = d_.states.size();
      Numbers y(n), f(n);
      fmu.call("fmi3GetContinuousStates", y.data(), n);
      fmu.call("fmi3GetContinuousStateDerivatives", f.data(), n);
      y = combined(y, 0.01 * (stop_ - start_), f);
      fmu.call("fmi3SetContinuousStates", y.data(), n);
      const Numbers u = seed(n), v = seed(unknowns.size());
      const Numbers forward = fmu.product("fmi3GetDirectionalDerivative", unknowns, d_.states, u),
                    backward = fmu.product("fmi3GetAdjointDerivative", unknowns, d_.states, v);
      const auto at = [&](double h) {
        const Numbers x = combined(y, h, u);
        fmu.call("fmi3SetContinuousStates", x.data(), n);
        return fmu.get(unknowns);
      };
      const double h = 1e-5;
      const Numbers high = at(h), low = at(-h);
      Numbers differences = combined(high, -1, low);
      for (double& x : differences) x /= 2 * h;
      compare("by_states", forward, u, v, backward, differences);
      // By the parameters besides: the two products of each other alone.
      References knowns = d_.states;
      knowns.insert(knowns.end(), d_.parameters.begin(), d_.parameters.end());
      fmu.call("fmi3SetContinuousStates", y.data(), n);
      const Numbers w = seed(knowns.size()), both = fmu.product("fmi3GetDirectionalDerivative", unknowns, knowns, w),
                    back = fmu.product("fmi3GetAdjointDerivative", unknowns, knowns, v);
      compare("by_both", both, w, v, back, both);
      // By the time there is none: refused with a sentence.
      Numbers r(1);
      const References time = {0}, one = {d_.derivatives[0]};
      const Numbers s = {1};
      j["by_time"] = fmu.status("fmi3GetDirectionalDerivative", one.data(), std::size_t{1}, time.data(), std::size_t{1},
                                s.data(), std::size_t{1}, r.data(), std::size_t{1});
      j["said"] = fmu.said;
    }
    // At the start by the parameters, of which the states are functions.
    if (d_.parameters.empty()) return;
    Fmu fmu(library_, d_, folder_, true);
    const References& p = d_.parameters;
    const Numbers rho = fmu.get(p);
    Numbers u = seed(p.size());
    for (std::size_t i = 0; i < u.size(); ++i) u[i] *= std::max(1e-3, std::abs(rho[i]));
    fmu.initialize(start_, stop_);
    const Numbers v = seed(d_.initial.size());
    const Numbers forward = fmu.product("fmi3GetDirectionalDerivative", d_.initial, p, u),
                  backward = fmu.product("fmi3GetAdjointDerivative", d_.initial, p, v);
    const auto at = [&](double h) {
      fmu.set(p, combined(rho, h, u));
      return fmu.get(d_.initial);
    };
    const double h = 1e-5;
    const Numbers high = at(h), low = at(-h);
    Numbers differences = combined(high, -1, low);
    for (double& x : differences) x /= 2 * h;
    compare("of_start", forward, u, v, backward, differences);
  }

  fs::path folder_;
  Description d_;
  Library library_;
  std::map<std::string, double> values_;
  double start_ = 0, stop_ = 0;
  int jumps_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc < 4) fail("fmu_importer FILE.fmu FOLDER STEPS [NAME=VALUE ...]");
    unpack(bytes_of(argv[1]), argv[2]);
    std::map<std::string, double> values;
    for (int i = 4; i < argc; ++i) {
      const std::string text = argv[i];
      values[text.substr(0, text.find('='))] = std::stod(text.substr(text.find('=') + 1));
    }
    std::cout << Importer(fs::absolute(argv[2]), values).run(std::stol(argv[3])).dump() << '\n';
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "fmu_importer: " << e.what() << '\n';
    return 1;
  }
}
