// Coefficients of polynomials, lowest power first, fitted by tests/battery/fit_polynomials.py.
// Errors are before rounding.
#pragma once

namespace solidtex::engine {

// -2 log(1 + f) / f, f in [-0.293, 0.414], 1.6e-09
inline constexpr float kMinus2Log1p[] = {-2.0f,
                                         0.9999995231628418f,
                                         -0.6666663885116577f,
                                         0.5000485777854919f,
                                         -0.4000556766986847f,
                                         0.3318690061569214f,
                                         -0.2832053601741791f,
                                         0.2666580080986023f,
                                         -0.26116418838500977f,
                                         0.15214651823043823f};

// upper normal quantile / s, top; absolute 3.8e-08
inline constexpr float kQuantileTop[] = {1.4756630659103394f, 1.5872911214828491f,
                                         0.466167688369751f, 0.03596135973930359f};

// its bottom, after the leading 1
inline constexpr float kQuantileBottom[] = {1.239675760269165f, 0.4253420829772949f,
                                            0.03593936190009117f};

inline constexpr float kQuantileStart = 1.1774100065231323f;

// (exp(r) - 1 - r) / r^2, |r| <= log(2) / 2, absolute 3.4e-09
inline constexpr float kExp[] = {0.5f, 0.16666512191295624f, 0.0416661873459816f,
                                 0.008369598537683487f, 0.0013951718574389815f};

// (tanh(x) / x - 1) / x^2 in x^2, |x| <= 0.625, 4.4e-09
inline constexpr float kTanh[] = {-0.3333328068256378f, 0.13331441581249237f, -0.05373971536755562f,
                                  0.02063908986747265f, -0.005704989191144705f};

// (sin(pi x / 2) / x - 1) / (1 - x^2) in x^2, |x| <= 1, 3.7e-09
inline constexpr float kQuarterSine[] = {0.5707963109016418f, -0.07516701519489288f,
                                         0.004521209746599197f, -0.00015062687452882528f};

}  // namespace solidtex::engine
