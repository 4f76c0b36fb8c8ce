// What 'costate check' finds in its rows, motions and cycles: a sentence of each that is not well, by what is wrong.
#pragma once

#include <string>
#include <vector>

#include "check_judge.h"
#include "command.h"

namespace costate::app {

struct CheckFindings {
  std::vector<std::string> wrong, failed, inaccurate, cut;

  void add(Verdict verdict, const std::string& sentence);
  /// disagreements, failures, inaccurate, cut.
  void write(Json& j) const;
  std::string text() const;
  void print() const;
  /// Where nothing disagrees.
  std::string agreement(double patience) const;
};

}  // namespace costate::app
