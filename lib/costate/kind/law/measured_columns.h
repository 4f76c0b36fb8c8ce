// The columns of measured data that a law gives as they are, and whether their units are what it stands for.
#pragma once

#include <string>
#include <vector>

#include "costate/kind/law/law_options.h"
#include "costate/scene/data_table.h"

namespace costate {

struct MeasuredColumn {
  std::string path;     // below that of the law: "column", "terms[1].column"
  DataColumn column;    // its name and unit
  DataColumn argument;  // what it is given over
};
/// Of laws through data, and of such terms in sums. Where a scale stands before one, that may be what turns one
/// quantity into the other, as factors of a product may: those are not among them.
std::vector<MeasuredColumn> measured_columns(const LawOptions& law);

/// Throws ModelError at a column that is of another quantity than this unit of the law under `path`, or that is given
/// over another than `argument`. Empty units say nothing.
void require_units(const std::string& path, const LawOptions& law, const std::string& unit,
                   const std::string& argument = {});

}  // namespace costate
