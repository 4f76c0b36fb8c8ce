// [options] of a study: those of the commands that its runs are, as they describe themselves.
#pragma once

#include <string>
#include <vector>

#include "costate/scene/scene_node.h"

namespace costate::app {

/// The commands that a run can be, the default first.
const std::vector<std::string>& study_tasks();

/// Whether a task's command has an option, named as in a study: without dashes in front, and with underscores.
bool task_takes(const std::string& task, const std::string& option);

/// Appends the words for the task's command. Of a table for runs of several `tasks` each takes what its command has;
/// what none of them has is a mistake, as is a value that the command line cannot read.
void add_options(const SceneNode& table, const std::string& title, const std::string& task,
                 const std::vector<std::string>& tasks, std::vector<std::string>& out);

}  // namespace costate::app
