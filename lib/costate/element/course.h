// What the laws of a mechanism do along time, or along something that the motion travels (a road under a wheel): where
// they begin, how short they are, how often they repeat. Integrators choose their steps by what they have met; at rest
// they would step over what begins late or is short. A course tells how far a step may go before it has to look:
// it ends where something begins, and within it takes half of the length over which the law is smooth.
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace costate {

class ScalarLaw;
class CostTerm;
struct LocalState;

/// What a law says of itself between `from` and `to`, for its own numbers.
struct LawPlaces {
  double from = 0, to = 0;
  /// Where something begins, ends or bends: between two neighbours the law is as smooth as they are apart, or searched
  /// from there on by halves.
  std::vector<double> sharp;
  /// Further places at which it has to be looked at (the knots of a table).
  std::vector<double> knots;
  struct Wave {
    double from, to, length;
  };
  /// Where it repeats, on and on, over this length.
  std::vector<Wave> waves;
  /// Whether something may hide between these places: the law is looked at on a fine grid, too.
  bool search = false;
};

/// A law that knows its places is one of these as well; any other is searched for them.
class PlacedLaw {
 public:
  virtual ~PlacedLaw() = default;
  virtual void add_places(const double* p, LawPlaces& places) const = 0;
};

/// The places of any law.
void add_law_places(const ScalarLaw& law, const double* p, LawPlaces& places);

class Course {
 public:
  /// Of what happens between; an argument outside is of no interest.
  Course(double from, double to) : from_(from), to_(to) {}
  /// For who wants the laws themselves: each f(rate (x - shift)) with its numbers is told, and nothing is made of it.
  using LawSink = std::function<void(const ScalarLaw& f, const double* p, double shift, double rate)>;
  explicit Course(LawSink told) : told_(std::move(told)) {}
  double from() const { return from_; }
  double to() const { return to_; }

  /// Whose laws come next, for messages.
  void begin_owner(const std::string& name);
  /// The law f(rate (x - shift)) with its numbers p.
  void add(const ScalarLaw& f, const double* p, double shift = 0, double rate = 1);
  /// Something else that depends on x, and may jump, without places of its own.
  void search(const std::function<double(double)>& f);
  /// Something smooth between two places, to be met by steps of this length at most.
  void add_look(double from, double to, double step);
  /// To be called when all is added.
  void finish();

  bool empty() const { return pieces_.empty(); }
  /// Calls visit(x) for where all that was added begins and ends, in no order.
  template <class Visit>
  void for_each_end(const Visit& visit) const {
    for (const Piece& look : looks_) {
      visit(look.from);
      visit(look.to);
    }
  }
  struct Bound {
    double end = std::numeric_limits<double>::infinity();   // where the step ends at the latest
    double step = std::numeric_limits<double>::infinity();  // what is asked for there
    int owner = -1;
  };
  /// For a step from x on upwards, or downwards (end = -infinity where nothing bounds it).
  Bound bound(double x, bool downwards) const;
  /// The next place behind x, upwards, where something begins or ends, or is to be met by other steps; infinite where
  /// there is none.
  double next_place(double x) const;
  /// The shortest step that is asked for between two places, or infinity.
  double least_step(double from, double to) const;
  const std::string& owner(int i) const { return owners_[static_cast<std::size_t>(i)]; }

 private:
  struct Piece {
    double from, to, step;
    int owner;
  };
  double from_ = 0, to_ = 0;
  LawSink told_;
  std::vector<Piece> looks_, pieces_;  // as added; disjoint and in order
  std::vector<double> sharp_;          // where laws bend: in order once all is added
  std::vector<std::string> owners_;
};

/// An element with laws of time, or along something that the motion travels, is one of these as well.
class CourseElement {
 public:
  virtual ~CourseElement() = default;
  /// What its laws of time do, for its numbers p.
  virtual void add_course(const double*, Course&) const {}
  /// The same for laws along tracks: how many, what is on one, and where on it the motion is.
  virtual int tracks() const { return 0; }
  virtual void add_track(int, const double*, Course&) const {}
  struct Place {
    double at = 0, speed = 0;
  };
  virtual Place track_place(int, const LocalState&) const { return {}; }
};

/// For elements of a common class whose law alone decides: whether this is one of them, whose course is then added.
class Element;
using ElementCourse = std::function<bool(const Element& element, const double* p, Course& course)>;
struct RegisterElementCourse {
  explicit RegisterElementCourse(ElementCourse course);
};
const std::vector<ElementCourse>& element_courses();

/// What the laws of time of a cost's term do, for the mechanism's numbers.
void add_cost_course(const CostTerm& term, const std::vector<double>& numbers, Course& course);

}  // namespace costate
