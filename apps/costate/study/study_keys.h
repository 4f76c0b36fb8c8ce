// The keys of a study's tables, read with their checks: a mistake throws SceneError at its place.
#pragma once

#include <string>
#include <vector>

#include "costate/scene/scene_node.h"

namespace costate::app::study_keys {

inline constexpr double kMostPoints = 100000;  // of a design

[[noreturn]] void fail(const SourceLocation& where, const std::string& message);
void require_known(const SceneNode& table, const std::string& title, const std::vector<std::string>& known);
const SceneNode& require_table(const SceneNode& n, const std::string& title);
/// Empty where it is not there and need not be.
std::string text_of(const SceneNode& table, const std::string& key, const std::string& title, bool required);
/// One of these words; the first where it is not there and need not be.
std::string word_of(const SceneNode& table, const std::string& key, const std::string& title,
                    const std::vector<std::string>& words, bool required);
std::vector<std::string> texts_of(const SceneNode& table, const std::string& key, const std::string& title);
/// A finite number.
double number_of(const SceneNode& table, const std::string& key, const std::string& title);
/// An integer from `least` to kMostPoints.
int count_of(const SceneNode& table, const std::string& key, const std::string& title, int least);

}  // namespace costate::app::study_keys
