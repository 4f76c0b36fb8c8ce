// Road surfaces in the ASCII formats of OpenCRG (ASAM, 1.2), as tables of data: heights along lines beside a straight
// reference line.
#pragma once

#include <memory>
#include <string>

#include "costate/scene/data_table.h"

namespace costate {

/// Whether a file is one by its name, NAME.crg.
bool is_open_crg(const std::string& file);

/// Columns "u" [m], along the reference line, in the place of the time, and for each long section "v=-0.75", its height
/// [m], v [m] to the left: that of the reference line (its start and slope), plus banking times v, plus the grid's; NaN
/// where the grid has none. Throws SceneError at file:line:column, and for what has no such columns: reference lines
/// that bend, modifiers, references to other files, binary formats.
std::shared_ptr<DataTable> read_open_crg(const std::string& name, const std::string& file);

}  // namespace costate
