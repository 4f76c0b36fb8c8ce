// A page of SVG with a few shapes and with names that find places of their own: each is put beside what it
// names, where it covers least.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace costate::app {

using Eigen::Vector2d;

class SvgPage {
 public:
  SvgPage(double width, double height, double font);

  // Shapes; coordinates in pixels, y downwards; `style` holds SVG attributes.
  void line(const Vector2d& a, const Vector2d& b, const std::string& style);
  void polygon(const std::vector<Vector2d>& corners, const std::string& style);
  void circle(const Vector2d& at, double radius, const std::string& style);
  void arrow(const Vector2d& from, const Vector2d& to, const std::string& color, double width = 2.5);
  /// A zigzag of 12 half-waves.
  void spring(const Vector2d& a, const Vector2d& b, const std::string& style);
  /// Three quarters of a circle with a head.
  void turn(const Vector2d& at, double radius, const std::string& color);
  /// A triangle with hatching below a point.
  void ground(const Vector2d& at);

  /// A name to be placed at the end, not nearer to `at` than `clear` and if possible in the direction `away`.
  void name(const Vector2d& at, const Vector2d& away, double clear, const std::string& text, const std::string& color,
            bool bold = false);
  /// The page as text, all names placed.
  std::string text();
  /// Its parts: <svg ...> with the ground it is on, and what has been drawn, without names.
  std::string head() const;
  const std::string& shapes() const { return shapes_; }

 private:
  struct Name {
    Vector2d at, away;
    double clear;
    std::string text, color;
    bool bold;
  };
  struct Box {
    double left, top, right, bottom;
  };
  double cost(const Box& box, const Name& name) const;
  void place(const Name& name);
  void keep_clear(const Vector2d& a, const Vector2d& b) { obstacles_.emplace_back(a, b); }

  double width_, height_, font_;
  std::string shapes_, names_text_;
  std::vector<Name> names_;
  std::vector<Box> boxes_;
  std::vector<std::pair<Vector2d, Vector2d>> obstacles_;
};

}  // namespace costate::app
