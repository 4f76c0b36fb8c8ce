// costate: simulation, exact gradients and design optimization of multibody systems from scene files.
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "command.h"
#include "compare.h"
#include "costate/base/error.h"
#include "costate/base/version.h"
#include "costate/record/interrupt.h"

namespace {

using costate::app::CommonOptions;

/// What is wrong with the command line, with the names that may have been meant.
std::string usage_message(const CLI::App& app, int argc, char** argv, const CLI::ParseError& e) {
  const auto chosen = app.get_subcommands();
  if (chosen.empty()) {
    if (argc < 2 || argv[1][0] == '-') return e.what();
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
      commands.push_back(command->get_name());
    return fmt::format("There is no command '{}'.{}", argv[1], costate::suggestion(argv[1], commands));
  }
  if (e.get_exit_code() != static_cast<int>(CLI::ExitCodes::ExtrasError)) return e.what();
  const CLI::App& command = *chosen.front();
  std::vector<std::string> options;
  for (const CLI::Option* option : command.get_options())
    for (const auto& name : option->get_lnames()) options.push_back("--" + name);
  for (int i = 2; i < argc; ++i) {
    const std::string name(argv[i], std::strcspn(argv[i], "="));
    if (name.rfind("--", 0) == 0 && std::find(options.begin(), options.end(), name) == options.end())
      return fmt::format("'costate {}' has no option '{}'.{}", command.get_name(), name,
                         costate::suggestion(name, options));
  }
  return e.what();
}

/// A failed run: the message on standard error and, with --json, the one object on standard output.
int complain(bool json, const char* status, const std::string& message, int code) {
  fmt::print(stderr, "costate: {}\n", message);
  if (json) {
    costate::app::Json j;
    j["status"] = status;
    j["error"] = message;
    std::puts(costate::app::json_text(j).c_str());
  }
  return code;
}

/// Standard output may be a full disk: a result that did not get there is a failure.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
  fmt::print(stderr, "costate: standard output cannot be written: {}\n", std::strerror(errno));
  return code != 0 ? code : costate::app::kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulation, exact gradients and design optimization of multibody systems.");
  app.set_version_flag("--version", std::string(costate::version));
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  app.footer("Exit status: 0 done, 1 failed or moved (regress), 2 wrong command line, 3 check found a disagreement, 130 interrupted.");

  CommonOptions common;
  std::function<int()> action;
  costate::app::add_simulate(app, action, common);
  costate::app::add_gradient(app, action, common);
  costate::app::add_optimize(app, action, common);
  costate::app::add_check(app, action, common);
  costate::app::add_compare(app, action, common);
  costate::app::add_regress(app, action, common);
  costate::app::add_equilibrium(app, action, common);
  costate::app::add_modes(app, action, common);
  costate::app::add_sweep(app, action, common);
  costate::app::add_study(app, action, common);
  costate::app::add_list(app, action, common);
  costate::app::add_dump(app, action, common);
  costate::app::add_draw(app, action, common);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    // The parser gave up somewhere, possibly before it came to --json.
    const bool json = std::any_of(argv + 1, argv + argc, [](std::string_view a) { return a == "--json"; });
    const int code = complain(json, "failed", usage_message(app, argc, argv, e), costate::app::kUsage);
    fmt::print(stderr, "Run 'costate --help' or 'costate COMMAND --help'.\n");
    return flushed(code);
  }
  costate::install_interrupt_handler();
  try {
    return flushed(action());
  } catch (const costate::Interrupted& e) {
    return flushed(complain(common.json, "interrupted", e.what(), 128 + e.signal_number()));
  } catch (const std::exception& e) {
    return flushed(complain(common.json, "failed", e.what(), costate::app::kFailed));
  }
}
