#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>

#include "costate/base/error.h"
#include "costate/element/law/formula_law.h"

namespace costate {

namespace {
constexpr int kLargestWholePower = 1000000;
constexpr int kDeepestNesting = 100;
}  // namespace

/// Recursive descent: sum = product {(+|-) product}, product = sign {(*|/) sign}, sign = -sign | power,
/// power = atom [^ sign].
class FormulaLaw::Parser {
 public:
  Parser(const std::string& text, FormulaLaw& law, std::vector<std::string>* others = nullptr)
      : text_(text), law_(law), others_(others) {}

  void read() {
    sum();
    if (skip(); at_ < text_.size()) fail(fmt::format("'{}' is unexpected", text_[at_]));
  }

  static const std::vector<std::pair<std::string, Op>>& known_functions() {
    static const std::vector<std::pair<std::string, Op>> functions = {
        {"sin", Op::sin},      {"cos", Op::cos},   {"tan", Op::tan},   {"exp", Op::exp},
        {"log", Op::log},      {"sqrt", Op::sqrt}, {"tanh", Op::tanh}, {"atan", Op::atan},
        {"abs", Op::absolute}, {"min", Op::least}, {"max", Op::most}};
    return functions;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw ModelError("",
                     fmt::format("The formula \"{}\" cannot be read at its character {}: {}.", text_, at_ + 1, what));
  }
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  void push(Step step) {
    const bool value = step.op == Op::constant || step.op == Op::variable || step.op == Op::number;
    const bool pair = step.op == Op::add || step.op == Op::subtract || step.op == Op::multiply ||
                      step.op == Op::divide || step.op == Op::power || step.op == Op::least || step.op == Op::most ||
                      step.op == Op::map;
    depth_ += value ? 1 : pair ? -1 : 0;
    if (depth_ > kDepth) fail("it is nested too deeply; split it with { kind = \"sum\" } or \"product\"");
    law_.program_.push_back(step);
  }
  void sum() {
    if (++nesting_ > kDeepestNesting) fail("it has too many parentheses");
    product();
    for (;;)
      if (take('+')) {
        product();
        push({Op::add});
      } else if (take('-')) {
        product();
        push({Op::subtract});
      } else {
        --nesting_;
        return;
      }
  }
  void product() {
    sign();
    for (;;)
      if (take('*')) {
        sign();
        push({Op::multiply});
      } else if (take('/')) {
        sign();
        push({Op::divide});
      } else {
        return;
      }
  }
  void sign() {
    bool negative = false;
    for (;;)
      if (take('-'))
        negative = !negative;
      else if (!take('+'))
        break;
    power();
    if (negative) push({Op::negate});
  }
  void power() {
    atom();
    if (!take('^')) return;
    if (++nesting_ > kDeepestNesting) fail("it has too many powers");
    const std::size_t before = law_.program_.size();
    sign();
    --nesting_;
    // x^2 and x^-2 hold for negative x, too.
    auto& program = law_.program_;
    const bool negative = program.size() == before + 2 && program.back().op == Op::negate;
    const Step& n = program[before];
    if ((negative || program.size() == before + 1) && n.op == Op::constant && n.value >= 0 &&
        n.value <= kLargestWholePower && n.value == std::floor(n.value)) {
      const int power = static_cast<int>(n.value);
      program.resize(before);
      --depth_;
      return push({Op::whole_power, 0, negative ? -power : power});
    }
    push({Op::power});
  }
  void atom() {
    if (take('(')) {
      sum();
      return close();
    }
    skip();
    if (at_ >= text_.size()) fail("it ends where a number, a name or '(' is needed");
    const auto c = static_cast<unsigned char>(text_[at_]);
    if (std::isdigit(c) || c == '.') return literal();
    if (std::isalpha(c) || c == '_') return name();
    if (others_ && c == '\'') return quoted_name();
    fail(fmt::format("'{}' stands where a number, a name or '(' is needed", text_[at_]));
  }
  void literal() {
    double value = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc()) fail("this is no number");
    at_ = static_cast<std::size_t>(end - text_.data());
    push({Op::constant, value});
  }
  void push_number(const std::string& word) {
    const auto at = std::find(law_.names_.begin(), law_.names_.end(), word);
    push({Op::number, 0, static_cast<int>(at - law_.names_.begin())});
    if (at != law_.names_.end()) return;
    law_.names_.push_back(word);
    others_->push_back(word);
  }
  void quoted_name() {
    const std::size_t end = text_.find('\'', at_ + 1);
    if (end == std::string::npos) fail("a closing ' is missing");
    const std::string word = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    push_number(word);
  }
  void name() {
    std::size_t end = at_;
    const auto in_name = [&](char c) {
      return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || (others_ && c == '.');
    };
    while (end < text_.size() && in_name(text_[end])) ++end;
    const std::string word = text_.substr(at_, end - at_);
    const auto& functions = known_functions();
    const auto called = std::find_if(law_.functions_.begin(), law_.functions_.end(),
                                     [&](const FormulaFunction& f) { return f.name == word; });
    if (called != law_.functions_.end()) {
      at_ = end;
      const int index = static_cast<int>(called - law_.functions_.begin());
      open(word);
      sum();
      if (!called->map) {
        if (take(',')) fail(fmt::format("'{}' is a law, of one argument; a map has two", word));
        close();
        return push({Op::function, 0, index});
      }
      if (!take(',')) fail(fmt::format("'{}' is a map, of two arguments, with a ',' between", word));
      sum();
      if (take(',')) fail(fmt::format("'{}' is a map, of two arguments", word));
      close();
      return push({Op::map, 0, index});
    }
    const auto number = std::find(law_.names_.begin(), law_.names_.end(), word);
    const auto function =
        std::find_if(functions.begin(), functions.end(), [&](const auto& f) { return f.first == word; });
    if (number != law_.names_.end()) {
      at_ = end;
      return push({Op::number, 0, static_cast<int>(number - law_.names_.begin())});
    }
    if (word == "t" || (word == "x" && !others_)) {
      at_ = end;
      return push({Op::variable});
    }
    if (word == "pi") {
      at_ = end;
      return push({Op::constant, std::numbers::pi});
    }
    if (others_ && function == functions.end()) {
      at_ = end;
      if (take('(')) {
        std::vector<std::string> known;
        for (const auto& f : functions) known.push_back(f.first);
        for (const auto& f : law_.functions_) known.push_back(f.name);
        fail(fmt::format(
            "there is no function '{0}'.{1} A law beside the formula is one: {0} = {{ kind = \"data\", data "
            "= \"NAME\", column = \"...\" }}",
            word, suggestion(word, known)));
      }
      return push_number(word);
    }
    if (function == functions.end()) {
      std::vector<std::string> known = law_.names_;
      for (const char* k : {"t", "x", "pi"}) known.emplace_back(k);
      for (const auto& f : functions) known.push_back(f.first);
      fail(fmt::format("'{}' is unknown; give its number as a key beside 'formula'.{}", word, suggestion(word, known)));
    }
    const bool several = function->second == Op::least || function->second == Op::most;
    if (!others_ && (several || function->second == Op::absolute))
      fail(
          fmt::format("'{}' bends at places that a law of one variable would have to know; take a law that does: "
                      "{{ kind = \"table\" }} or \"piecewise\"",
                      word));
    at_ = end;
    if (!several) {
      argument(word);
      return push({function->second});
    }
    open(word);
    sum();
    if (!take(',')) fail(fmt::format("'{}' needs two arguments or more, with a ',' between", word));
    do {
      sum();
      push({function->second});
    } while (take(','));
    close();
  }
  void open(const std::string& function) {
    if (!take('(')) fail(fmt::format("'{}' needs its argument in parentheses", function));
  }
  void close() {
    if (!take(')')) fail("a ')' is missing");
  }
  void argument(const std::string& function) {
    open(function);
    sum();
    close();
  }

  const std::string& text_;
  FormulaLaw& law_;
  std::vector<std::string>* others_;  // where they are allowed
  std::size_t at_ = 0;
  int depth_ = 0, nesting_ = 0;
};

FormulaLaw::FormulaLaw(const std::string& text, std::vector<std::string> names) : names_(std::move(names)) {
  Parser(text, *this).read();
}

FormulaLaw::FormulaLaw(const std::string& text, std::vector<std::string> names, std::vector<std::string>& others,
                       std::vector<FormulaFunction> functions)
    : names_(std::move(names)), functions_(std::move(functions)) {
  Parser(text, *this, &others).read();
}

bool FormulaLaw::has_function(const std::string& name) {
  const auto& known = Parser::known_functions();
  return std::any_of(known.begin(), known.end(), [&](const auto& f) { return f.first == name; });
}

}  // namespace costate
