#include "command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstring>

#include "command.h"
#include "costate/base/error.h"
#include "costate/base/version.h"

namespace costate::app {

namespace {

struct Registered {
  CommandGroup group;
  std::string name, summary;
  std::function<void(Command&, CommonOptions&)> describe;
};

std::vector<Registered>& registered() {
  static std::vector<Registered> commands;
  return commands;
}

const char* title(CommandGroup group) {
  switch (group) {
    case CommandGroup::run:
      return "Run";
    case CommandGroup::judge:
      return "Judge";
    case CommandGroup::analyse:
      return "Analyse";
    case CommandGroup::inspect:
      return "Inspect";
  }
  return "";
}

/// What is wrong with the command line, with the names that may have been meant.
std::string usage_message(const CLI::App& app, int argc, const char* const* argv, const CLI::ParseError& e) {
  const auto chosen = app.get_subcommands();
  if (chosen.empty()) {
    if (argc < 2 || argv[1][0] == '-') return e.what();
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
      commands.push_back(command->get_name());
    return fmt::format("There is no command '{}'.{}", argv[1], suggestion(argv[1], commands));
  }
  if (e.get_exit_code() != static_cast<int>(CLI::ExitCodes::ExtrasError)) return e.what();
  const CLI::App& command = *chosen.front();
  std::vector<std::string> options;
  for (const CLI::Option* option : command.get_options())
    for (const auto& name : option->get_lnames()) options.push_back("--" + name);
  for (int i = 2; i < argc; ++i) {
    const std::string name(argv[i], std::strcspn(argv[i], "="));
    if (name.rfind("--", 0) == 0 && std::find(options.begin(), options.end(), name) == options.end())
      return fmt::format("'costate {}' has no option '{}'.{}", command.get_name(), name, suggestion(name, options));
  }
  return e.what();
}

}  // namespace

CommandOption& CommandOption::required(bool is) {
  option_->required(is);
  return *this;
}

CommandOption& CommandOption::text(const std::string& description) {
  option_->description(description);
  return *this;
}

CommandOption& CommandOption::value_name(const std::string& name) {
  option_->type_name(name);
  return *this;
}

CommandOption& CommandOption::separated() {
  option_->delimiter(',')->allow_extra_args(false);
  return *this;
}

CommandOption& CommandOption::repeatable() {
  option_->allow_extra_args(false);
  return *this;
}

CommandOption& CommandOption::shows_default() {
  option_->capture_default_str();
  return *this;
}

CommandOption& CommandOption::among(const std::vector<std::string>& values) {
  option_->check(CLI::IsMember(values));
  return suggests(values);
}

CommandOption& CommandOption::suggests(std::vector<std::string> values) {
  words_[option_] = std::move(values);
  return *this;
}

CommandOption& CommandOption::between(double lowest, double highest) {
  option_->check(CLI::Range(lowest, highest));
  return *this;
}

CommandOption& CommandOption::seen(std::function<void()> then) {
  option_->each([then = std::move(then)](const std::string&) { then(); });
  return *this;
}

CommandOption Command::option(const std::string& names, std::string& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, std::vector<std::string>& values, const std::string& text) {
  return {parser_.add_option(names, values, text), words_};
}
CommandOption Command::option(const std::string& names, std::filesystem::path& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, double& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, int& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, long& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, std::optional<double>& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, std::optional<int>& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::option(const std::string& names, std::optional<long>& value, const std::string& text) {
  return {parser_.add_option(names, value, text), words_};
}
CommandOption Command::flag(const std::string& names, bool& value, const std::string& text) {
  return {parser_.add_flag(names, value, text), words_};
}

CommandOption Command::existing(const std::string& name) { return {parser_.get_option(name), words_}; }

void Command::remove(const std::string& name) {
  words_.erase(parser_.get_option(name));
  parser_.remove_option(parser_.get_option(name));
}

void Command::footer(const std::string& text) { parser_.footer(text); }

void Command::runs(std::function<int()> action) {
  parser_.callback([this_action = &action_, action = std::move(action)] { *this_action = action; });
}

RegisterCommand::RegisterCommand(CommandGroup group, std::string name, std::string summary,
                                 std::function<void(Command&, CommonOptions&)> describe) {
  auto& all = registered();
  const auto before = [](const Registered& a, const Registered& b) {
    return std::pair(a.group, a.name) < std::pair(b.group, b.name);
  };
  Registered command{group, std::move(name), std::move(summary), std::move(describe)};
  const auto place = std::upper_bound(all.begin(), all.end(), command, before);
  all.insert(place, std::move(command));
}

CommandLine::CommandLine()
    : parser_(std::make_unique<CLI::App>("Simulation, exact gradients and design optimization of multibody systems.",
                                         "costate")),
      common_(std::make_unique<CommonOptions>()) {
  parser_->set_version_flag("--version", std::string(version));
  parser_->require_subcommand(1);
  parser_->get_formatter()->column_width(34);
  parser_->footer(
      "Exit status: 0 done, 1 failed or moved (regress), 2 wrong command line, 3 check found a disagreement, "
      "130 "
      "interrupted.");
  for (const Registered& r : registered()) {
    CLI::App* parser = parser_->add_subcommand(r.name, r.summary);
    parser->group(title(r.group));
    Command command(*parser, action_, words_);
    r.describe(command, *common_);
  }
}

CommandLine::~CommandLine() = default;

void CommandLine::parse(int argc, const char* const* argv) {
  try {
    parser_->parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      parser_->exit(e);
      return;
    }
    throw UsageError(usage_message(*parser_, argc, argv, e));
  }
}

void CommandLine::parse(const std::vector<std::string>& words) {
  std::vector<const char*> argv = {"costate"};
  for (const auto& w : words) argv.push_back(w.c_str());
  parse(static_cast<int>(argv.size()), argv.data());
}

std::vector<std::string> CommandLine::option_names(const std::string& command) const {
  std::vector<std::string> names;
  const auto all = parser_->get_subcommands([&](const CLI::App* of) { return of->get_name() == command; });
  if (all.empty()) throw Error(fmt::format("There is no command '{}'.", command));
  for (const CLI::Option* option : all.front()->get_options())
    for (const auto& name : option->get_lnames()) names.push_back(name);
  return names;
}

std::string CommandLine::summary() const { return parser_->get_description(); }

std::string CommandLine::footer() const { return parser_->get_footer(); }

std::vector<CommandDescription> CommandLine::describe() const {
  std::vector<CommandDescription> commands;
  for (const CLI::App* command : parser_->get_subcommands([](const CLI::App*) { return true; })) {
    CommandDescription c{
        command->get_group(), command->get_name(), command->get_description(), command->get_footer(), {}};
    for (const CLI::Option* o : command->get_options()) {
      OptionDescription d;
      d.by_place = o->get_positional();
      if (d.by_place) d.names.push_back(o->get_single_name());
      for (const auto& name : o->get_snames()) d.names.push_back("-" + name);
      for (const auto& name : o->get_lnames()) d.names.push_back("--" + name);
      d.text = o->get_description();
      if (o->get_items_expected_max() > 0 && o->get_type_size_max() > 0)
        d.value = o->get_type_name().substr(0, o->get_type_name().find(':'));
      if (const auto words = words_.find(o); words != words_.end()) d.words = words->second;
      d.required = o->get_required();
      d.repeatable = o->get_items_expected_max() > 1;
      c.options.push_back(std::move(d));
    }
    commands.push_back(std::move(c));
  }
  return commands;
}

}  // namespace costate::app
