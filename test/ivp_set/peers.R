# Rscript peers.R LIBRARY: deSolve's solvers on a problem compiled from andrews.c or car_axis.c. Reads one run a line,
# 'SOLVER RTOL T_END', and answers each with one line: 'ok SECONDS STEPS EVALUATIONS Y...' or 'failed WHY'. Evaluations
# count those for Jacobians by differences. 'solvers' lists what can be asked for.
suppressPackageStartupMessages(library(deSolve))
library_file <- commandArgs(TRUE)[1]
name <- sub("\\.so$", "", basename(library_file))
dyn.load(library_file)

size <- .C("sizes", integer(3), PACKAGE = name)[[1]]
coordinates <- size[1]
unknowns <- 2 * coordinates + size[2] + size[3]
begin <- .C("start", double(unknowns), double(1), PACKAGE = name)
if (begin[[2]] > 1e-14) stop("the start is not consistent: ", begin[[2]])
y0 <- begin[[1]]
differential <- 2 * coordinates
algebraic <- unknowns - differential
diagonal_mass <- matrix(c(rep(1, differential), rep(0, algebraic)), nrow = 1)
rates0 <- c(y0[coordinates + seq_len(coordinates)], rep(0, coordinates + algebraic))
clock <- function() .C("seconds_now", double(1), PACKAGE = name)[[1]]
most_steps <- 200000

# Unknowns of index 1, 2 and 3 where the constraint stands at the level of this index.
indices <- function(index)
  if (index == 1) c(unknowns, 0, 0) else if (index == 2) c(differential, algebraic, 0) else
    c(coordinates, coordinates, algebraic)

by_radau <- function(index, jacobian = NULL) {
  force(index)
  force(jacobian)
  function(rtol, t_end)
    radau(y0, c(0, t_end), paste0("index", index), NULL, nind = indices(index), rtol = rtol, atol = rtol,
          mass = diagonal_mass, massup = 0, massdown = 0, jacfunc = jacobian, dllname = name, initfunc = NULL,
          jactype = if (is.null(jacobian)) "fullint" else "fullusr", maxsteps = most_steps)
}
by_daspk <- function(index) {
  rates <- rates0
  rates[coordinates + seq_len(coordinates)] <-
    .C("explicit_form", 0L, 0, y0, double(differential), 0, 0L, PACKAGE = name)[[4]][coordinates + seq_len(coordinates)]
  function(rtol, t_end)
    daspk(y0, c(0, t_end), NULL, NULL, dy = rates, res = paste0("residual", index), nind = indices(index), rtol = rtol,
          atol = rtol, dllname = name, initfunc = NULL, tcrit = t_end, maxsteps = most_steps)
}
by_lsode <- function(method) function(rtol, t_end)
  lsode(y0[1:differential], c(0, t_end), "explicit_form", NULL, rtol = rtol, atol = rtol, mf = method, dllname = name,
        initfunc = NULL, tcrit = t_end, maxsteps = most_steps)
by_runge_kutta <- function(method) function(rtol, t_end)
  rk(y0[1:differential], c(0, t_end), "explicit_form", NULL, rtol = rtol, atol = rtol, method = method, dllname = name,
     initfunc = NULL, hini = 1e-4 * t_end, maxsteps = most_steps)

solvers <- list(
  "radau-index1" = by_radau(1), "radau-index2" = by_radau(2), "radau-index3" = by_radau(3),
  "daspk-index1" = by_daspk(1), "daspk-index2" = by_daspk(2),
  "lsode-adams" = by_lsode(10), "lsode-bdf" = by_lsode(22), "rk78" = by_runge_kutta("rk78dp"))
if (is.loaded("jacobian1", PACKAGE = name))
  for (index in 1:3)
    solvers[[paste0("radau-index", index, "-simplified")]] <- by_radau(index, paste0("jacobian", index))

answer <- function(...) {
  cat(..., "\n")
  flush(stdout())
}
input <- file("stdin", "r")
while (length(line <- readLines(input, 1)) == 1) {
  words <- strsplit(line, " ")[[1]]
  if (words[1] == "solvers") {
    answer(names(solvers))
    next
  }
  t_end <- as.numeric(words[3])
  .C("evaluations_since", double(1), PACKAGE = name)
  complaints <- character()
  from <- clock()
  # deSolve tells of a run that stops by warnings and by what it prints.
  run <- withCallingHandlers(
    tryCatch({
      said <- capture.output(result <- solvers[[words[1]]](as.numeric(words[2]), t_end))
      list(result = result, seconds = clock() - from)
    }, error = function(e) { complaints <<- c(complaints, conditionMessage(e)); NULL }),
    warning = function(w) { complaints <<- c(complaints, conditionMessage(w)); invokeRestart("muffleWarning") })
  evaluations <- .C("evaluations_since", double(1), PACKAGE = name)[[1]]
  end <- if (is.null(run)) NA else run$result[nrow(run$result), -1]
  reached <- !is.null(run) && nrow(run$result) == 2 && run$result[2, 1] == t_end && all(is.finite(end))
  if (reached && !length(complaints))
    answer("ok", format(run$seconds, digits = 9), attr(run$result, "istate")[2], evaluations,
           format(end, digits = 17, trim = TRUE))
  else
    answer("failed", gsub("[\n ]+", " ", paste(complaints, collapse = "; ")))
}
