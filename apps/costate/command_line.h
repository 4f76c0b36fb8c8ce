// The commands of the tool as they describe themselves: name, options bound to variables, what is run. A
// command is one file that registers itself; the parser behind it, the help, the man page and the completions
// come from its description.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
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
  /// Words that a shell may complete, by option.
  using Words = std::map<const CLI::Option*, std::vector<std::string>>;
  CommandOption(CLI::Option* option, Words& words) : option_(option), words_(words) {}

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
  /// What a shell completes; the command itself judges what it is given.
  CommandOption& suggests(std::vector<std::string> values);
  CommandOption& between(double lowest, double highest);
  /// Called when the option is there, once a value.
  CommandOption& seen(std::function<void()> then);

 private:
  CLI::Option* option_;
  Words& words_;
};

/// One command while it describes itself. Variables must outlive it.
class Command {
 public:
  Command(CLI::App& parser, std::function<int()>& action, CommandOption::Words& words)
      : parser_(parser), action_(action), words_(words) {}

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
  CommandOption::Words& words_;
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

/// What the man page and the completions are made from.
struct OptionDescription {
  std::vector<std::string> names;  // "-o", "--output"; of one that stands by its place its name
  std::string text, value;         // what its value is called; empty for a flag
  std::vector<std::string> words;  // values to complete, if they are known
  bool by_place = false, required = false, repeatable = false;
};
struct CommandDescription {
  std::string group, name, summary, footer;
  std::vector<OptionDescription> options;
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
  /// What the tool is, what its exit status means, and its commands in the order of the help.
  std::string summary() const;
  std::string footer() const;
  std::vector<CommandDescription> describe() const;

 private:
  std::unique_ptr<CLI::App> parser_;
  std::unique_ptr<CommonOptions> common_;
  std::function<int()> action_;
  CommandOption::Words words_;
};

}  // namespace costate::app
