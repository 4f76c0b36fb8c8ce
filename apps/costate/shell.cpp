// costate man, costate completion: the manual page and the completions of shells, made from what the commands say of
// themselves, so that a new option is in all of them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

#include "command.h"
#include "costate/base/error.h"
#include "costate/base/version.h"

namespace costate::app {

namespace {

/// Text of a manual page: what its language would take for commands is escaped.
std::string roff(const std::string& text) {
  std::string r;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins_line = i == 0 || text[i - 1] == '\n';
    if (begins_line && (text[i] == '.' || text[i] == '\'')) r += "\\&";
    if (text[i] == '\\')
      r += "\\e";
    else if (text[i] == '-')
      r += "\\-";
    else
      r += text[i];
  }
  return r;
}

std::string man_option(const OptionDescription& o) {
  const std::string value = o.by_place ? "" : o.value;
  std::string names;
  for (const auto& name : o.names) names += (names.empty() ? "" : ", ") + name;
  return fmt::format(".TP\n\\fB{}\\fR{}\n{}{}\n", roff(names), value.empty() ? "" : " \\fI" + roff(value) + "\\fR",
                     roff(o.text), o.required ? " (required)" : "");
}

std::string man_page(const CommandLine& line) {
  std::string t = fmt::format(".TH COSTATE 1 \"\" \"costate {}\" \"User Commands\"\n", version);
  t += fmt::format(".SH NAME\ncostate \\- {}\n", roff(line.summary()));
  t += ".SH SYNOPSIS\n.B costate\n\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.br\n.B costate\n\\fICOMMAND\\fR "
       "\\fB\\-\\-help\\fR\n";
  t +=
      ".SH DESCRIPTION\n" +
      roff(
          "A scene is a file in TOML that describes a mechanism, its forces, a cost and its parameters. 'costate list' "
          "has the language of scenes, formulations and methods; 'costate list NAME' has all there is to say of "
          "one.\n");
  t += ".SH COMMANDS\n";
  std::string group;
  for (const CommandDescription& c : line.describe()) {
    if (c.group != group) t += fmt::format(".SS {}\n", roff(group = c.group));
    t += fmt::format(".TP\n\\fBcostate {}\\fR\n{}\n.RS\n", roff(c.name), roff(c.summary));
    for (const OptionDescription& o : c.options) t += man_option(o);
    if (!c.footer.empty()) t += ".PP\n" + roff(c.footer) + "\n";
    t += ".RE\n";
  }
  t += ".SH EXIT STATUS\n" + roff(line.footer()) + "\n";
  return t;
}

/// In single quotes for a shell.
std::string in_quotes(const std::string& text) {
  std::string r = "'";
  for (const char c : text) r += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return r + "'";
}

std::vector<std::string> dashed(const CommandDescription& c) {
  std::vector<std::string> names;
  for (const auto& o : c.options)
    if (!o.by_place) names.insert(names.end(), o.names.begin(), o.names.end());
  return names;
}

std::string bash_completion(const std::vector<CommandDescription>& commands) {
  std::vector<std::string> names, files;
  std::string values, options;
  for (const auto& c : commands) {
    names.push_back(c.name);
    std::vector<std::string> by_place;
    for (const auto& o : c.options) {
      if (o.by_place) by_place.insert(by_place.end(), o.words.begin(), o.words.end());
      if (o.by_place || o.value.empty()) continue;
      std::vector<std::string> patterns;
      for (const auto& name : o.names) patterns.push_back(in_quotes(c.name + " " + name));
      values += fmt::format("    {}) words={}; option_value=1 ;;\n", fmt::join(patterns, "|"),
                            in_quotes(fmt::format("{}", fmt::join(o.words, " "))));
    }
    options += fmt::format("    {}) options={}; words={} ;;\n", c.name,
                           in_quotes(fmt::format("{}", fmt::join(dashed(c), " "))),
                           in_quotes(fmt::format("{}", fmt::join(by_place, " "))));
  }
  return fmt::format(R"(# Completion of costate for bash.
_costate() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} words='' options='' option_value=0
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W {0} -- "$current"))
    return
  fi
  case "${{COMP_WORDS[1]}} $before" in
{1}  esac
  if [ "$option_value" -eq 1 ]; then
    # Of several values behind commas, the last.
    local done_before=''
    case "$current" in *,*) done_before=${{current%,*}},; current=${{current##*,}} ;; esac
    COMPREPLY=($(compgen -P "$done_before" -W "$words" -- "$current"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{2}  esac
  case "$current" in
    -*) COMPREPLY=($(compgen -W "$options" -- "$current")) ;;
    *) COMPREPLY=($(compgen -W "$words" -- "$current")) ;;
  esac
}}
complete -o default -F _costate costate
)",
                     in_quotes(fmt::format("{} --help --version", fmt::join(names, " "))), values, options);
}

/// Between the brackets of zsh's _arguments.
std::string bracketed(const std::string& text) {
  std::string r;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') r += '\\';
    r += c;
  }
  return r;
}

std::string zsh_completion(const std::vector<CommandDescription>& commands) {
  std::string list, cases;
  for (const auto& c : commands) {
    list += "    " + in_quotes(c.name + ":" + c.summary) + "\n";
    std::string arguments;
    std::vector<std::string> by_place;
    for (const auto& o : c.options) {
      if (o.by_place) by_place.insert(by_place.end(), o.words.begin(), o.words.end());
      if (o.by_place) continue;
      for (const auto& name : o.names) {
        std::string one = fmt::format("{}{}[{}]", o.repeatable ? "*" : "", name, bracketed(o.text));
        if (!o.value.empty())
          one += fmt::format(":{}:{}", bracketed(o.value),
                             o.words.empty() ? "_files" : fmt::format("({})", fmt::join(o.words, " ")));
        arguments += " \\\n        " + in_quotes(one);
      }
    }
    const std::string rest = by_place.empty() ? "*:file:_files" : fmt::format("*: :({})", fmt::join(by_place, " "));
    cases += fmt::format("    {})\n      _arguments{} \\\n        {} ;;\n", c.name, arguments, in_quotes(rest));
  }
  return fmt::format(R"(#compdef costate
# Completion of costate for zsh.
_costate() {{
  local -a commands
  commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe 'command' commands
    return
  fi
  shift words
  (( CURRENT-- ))
  case $words[1] in
{}  esac
}}
_costate "$@"
)",
                     list, cases);
}

const RegisterCommand man_command(CommandGroup::inspect, "man", "Print the manual page (costate man | man -l -)",
                                  [](Command& c, CommonOptions&) {
                                    c.runs([] {
                                      fmt::print("{}", man_page(CommandLine()));
                                      return 0;
                                    });
                                  });

const RegisterCommand completion_command(CommandGroup::inspect, "completion",
                                         "Print the completion of a shell (source <(costate completion bash))",
                                         [](Command& c, CommonOptions&) {
                                           auto shell = std::make_shared<std::string>();
                                           c.option("shell", *shell, "bash or zsh").required().among({"bash", "zsh"});
                                           c.runs([shell] {
                                             const auto commands = CommandLine().describe();
                                             fmt::print("{}", *shell == "bash" ? bash_completion(commands)
                                                                               : zsh_completion(commands));
                                             return 0;
                                           });
                                         });

}  // namespace

}  // namespace costate::app
