// What 'costate tradeoff' says of a study: as JSON, as a table for other programs, as text, and as a page.
#pragma once

#include <string>

#include "command.h"
#include "costate/tradeoff/trade_analysis.h"
#include "costate/tradeoff/trade_study.h"

namespace costate::app {

/// The measures that the table holds errors of, in their order.
std::vector<TradeMeasure> measures_of(const TradeTable& table);
/// "1.2e-06", or "<3e-13" where the reference certifies no less.
std::string error_text(const TradeTable& table, TradeMeasure measure, std::optional<double> error);
/// How the reference came about and what it certifies, as sentences.
std::vector<std::string> reference_sentences(const TradeStudy& study);

Json tradeoff_json(const Setup& setup, const TradeStudy& study);
std::string tradeoff_csv(const TradeStudy& study);
std::string tradeoff_text(const Setup& setup, const TradeStudy& study);
/// `note`: what interrupted it, or empty.
std::string tradeoff_page(const Setup& setup, const TradeStudy& study, const std::string& note);

}  // namespace costate::app
