// What the tool needs of MPI, as a table of functions: a library of its own holds them (libcostate_mpi.so), which is
// loaded only in programs that mpirun has started.
#pragma once

extern "C" {

struct CostateMessagePassing {
  int rank, size;
  /// Whether a message waits; then whose it is, and how many bytes it has.
  int (*waits)(int* source, int* bytes);
  void (*receive)(int source, char* bytes, int count);
  void (*send)(int to, const char* bytes, int count);
  /// Of all ranks: returns when every one of them has called it.
  void (*finish)();
  /// Ends all ranks.
  void (*abort)(int status);
};

/// The name of the function that the library exports: the table, of a program whose ranks have met.
using CostateMpiBegin = const CostateMessagePassing* (*)();
inline constexpr const char* kCostateMpiBegin = "costate_mpi_begin";
}
