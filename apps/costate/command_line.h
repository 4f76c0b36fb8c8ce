// The commands of the tool as they describe themselves: name, options bound to variables, what is run. A
// command is one file that registers itself; the parser behind it, the help, the man page and the completions
// come from its description.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace costate::app {

struct CommonOptions;

/// An option just described; each call refines it.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option* option) : option_(option) {}

  CommandOption& required(bool is = true);
  CommandOption& text(const std::string& description);
  /// What the help calls its value.
  CommandOption& value_name(const std::string& name);
  /// Values separated by commas; what follows behind a blank is no further value.
  CommandOption& separated();
  /// May be repeated, one value each.
  CommandOption& repeatable();
  CommandOption& shows_default();
  CommandOption& among(const std::vector<std::string>& values);
  CommandOption& between(double lowest, double highest);
  /// Called when the option is there, once a value.
  CommandOption& seen(std::function<void()> then);

 private:
  CLI::Option* option_;
};

/// One command while it describes itself. Variables must outlive it.
class Command {
 public:
  Command(CLI::App& parser, std::function<int()>& action) : parser_(parser), action_(action) {}

  /// "-o,--output", or a name without dashes for what stands by its place.
  CommandOption option(const std::string& names, std::string& value, const std::string& text);
  CommandOption option(const std::string& names, std::vector<std::string>& values, const std::string& text);
  CommandOption option(const std::string& names, std::filesystem::path& value, const std::string& text);
  CommandOption option(const std::string& names, double& value, const std::string& text);
  CommandOption option(const std::string& names, int& value, const std::string& text);
  CommandOption option(const std::string& names, long& value, const std::string& text);
  CommandOption option(const std::string& names, std::optional<double>& value, const std::string& text);
  CommandOption option(const std::string& names, std::optional<int>& value, const std::string& text);
  CommandOption option(const std::string& names, std::optional<long>& value, const std::string& text);
  CommandOption flag(const std::string& names, bool& value, const std::string& text);

  /// One that is there already, to refine it.
  CommandOption existing(const std::string& name);
  void remove(const std::string& name);
  /// Below the options in the help.
  void footer(const std::string& text);
  /// What the command does once the command line has been read; the tool's exit status.
  void runs(std::function<int()> action);

 private:
  CLI::App& parser_;
  std::function<int()>& action_;
};

/// The help lists commands by what they are for.
enum class CommandGroup { run, judge, analyse, inspect };

/// Static objects of this class make commands known.
struct RegisterCommand {
  RegisterCommand(CommandGroup group, std::string name, std::string summary,
                  std::function<void(Command&, CommonOptions&)> describe);
};

/// A command line that cannot be read.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// All registered commands, ready to read one command line.
class CommandLine {
 public:
  CommandLine();
  ~CommandLine();

  /// Throws UsageError. Without an action afterwards (--help, --version) all that was asked for has been
  /// printed.
  void parse(int argc, const char* const* argv);
  /// The same for words behind the tool's name.
  void parse(const std::vector<std::string>& words);

  CommonOptions& common() { return *common_; }
  const std::function<int()>& action() const { return action_; }
  /// Names of a command's options, without dashes.
  std::vector<std::string> option_names(const std::string& command) const;
  const CLI::App& parser() const { return *parser_; }

 private:
  std::unique_ptr<CLI::App> parser_;
  std::unique_ptr<CommonOptions> common_;
  std::function<int()> action_;
};

}  // namespace costate::app
