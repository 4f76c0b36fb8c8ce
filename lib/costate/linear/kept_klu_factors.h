// Factors that can be kept outside and brought back, by their pivot orders (klu_solver.h). Within klu_solver.cpp and
// complex_klu_solver.cpp.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "costate/linear/klu_factors.h"

namespace costate {

template <class Klu>
struct KeptKluFactors : KluFactors<Klu> {
  using KluFactors<Klu>::KluFactors;
  using KluFactors<Klu>::numeric;
  using KluFactors<Klu>::symbolic;
  using KluFactors<Klu>::common;
  using KluFactors<Klu>::full_growth;
  using KluFactors<Klu>::columns;

  // Factorizations with earlier pivot orders, oldest first, and their orders' numbers.
  struct Earlier {
    long order;
    klu_l_numeric* numeric;
    double full_growth;
    std::vector<double> columns;
  };
  std::vector<Earlier> earlier;
  std::size_t earlier_at_most = 0;

  ~KeptKluFactors() {
    for (Earlier& e : earlier) Klu::free(&e.numeric, &common);
  }

  /// The present factorization joins the earlier ones, or is freed.
  void retire(long order) {
    if (!numeric) return;
    earlier.push_back({order, std::exchange(numeric, nullptr), full_growth, columns});
    discard();
  }
  void discard() {
    while (earlier.size() > earlier_at_most) {
      Klu::free(&earlier.front().numeric, &common);
      earlier.erase(earlier.begin());
    }
  }
  void keep_orders(int at_most) {
    earlier_at_most = at_most > 1 ? static_cast<std::size_t>(at_most - 1) : 0;
    earlier.reserve(earlier_at_most + 1);
    discard();
  }

  /// Numbers that save() writes.
  std::size_t saved_size() const {
    if (!numeric) return 0;
    const klu_l_numeric& x = *numeric;
    // The counts of L and U include both diagonals, of which one is kept.
    return static_cast<std::size_t>(Klu::numbers * (x.lnz + x.unz - x.n + x.nzoff) + (x.Rs ? x.n : 0));
  }
  void save(double* to) const {
    if (!numeric) return;
    for_each_array([&](const double* x, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) to[i] = x[i];
      to += count;
    });
  }
  /// `present`: the number of the present factors' order, which becomes `order`. False when that has been discarded.
  bool restore(long& present, long order, const double* from) {
    if (order != present || !numeric) {
      const auto at = std::find_if(earlier.begin(), earlier.end(), [&](const Earlier& e) { return e.order == order; });
      if (at == earlier.end()) return false;
      if (numeric) {
        std::swap(at->numeric, numeric);
        std::swap(at->full_growth, full_growth);
        std::swap(at->columns, columns);
        std::swap(at->order, present);
      } else {
        numeric = at->numeric;
        full_growth = at->full_growth;
        columns = std::move(at->columns);
        present = at->order;
        earlier.erase(at);
      }
    }
    for_each_array([&](double* x, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) x[i] = from[i];
      from += count;
    });
    return true;
  }

 private:
  /// The numbers of a factorization without its indices, one array after the other: f(array, count). A column of L or U
  /// lies in its block as `length` indices, filled up to whole entries, followed by `length` entries.
  template <class F>
  void for_each_array(F&& f) const {
    constexpr SuiteSparse_long of_entry = Klu::numbers;
    const auto n = static_cast<std::size_t>(this->pattern->cols);
    const auto column = [&](double* block, SuiteSparse_long at, SuiteSparse_long length) {
      const SuiteSparse_long indices = (length + of_entry - 1) / of_entry;
      f(block + of_entry * (at + indices), static_cast<std::size_t>(of_entry * length));
    };
    for (SuiteSparse_long b = 0; b < numeric->nblocks; ++b) {
      auto* const block = static_cast<double*>(numeric->LUbx[b]);
      if (!block) continue;
      for (SuiteSparse_long k = symbolic->R[b]; k < symbolic->R[b + 1]; ++k) {
        column(block, numeric->Lip[k], numeric->Llen[k]);
        column(block, numeric->Uip[k], numeric->Ulen[k]);
      }
    }
    f(static_cast<double*>(numeric->Udiag), static_cast<std::size_t>(of_entry) * n);
    if (numeric->nzoff > 0) f(static_cast<double*>(numeric->Offx), static_cast<std::size_t>(of_entry * numeric->nzoff));
    if (numeric->Rs) f(numeric->Rs, n);
  }
};

}  // namespace costate
