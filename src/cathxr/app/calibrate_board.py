"""`cathxr calibrate board`: a calibration board as a true-scale PDF."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.calibration.board import parse_board
from cathxr.storage.atomic import check_writable, written_whole

_PAPERS = ("A4", "Letter")


@click.command("board")
@click.option(
    "--board",
    "text",
    default="charuco:10x10:6.0:4.0:DICT_4X4_50",
    show_default=True,
    help="charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY or chessboard:COLUMNSxROWS:SQUARE (inner corners).",
)
@click.option(
    "--paper",
    type=click.Choice([*_PAPERS, "both"], case_sensitive=False),
    default="A4",
    show_default=True,
    help="The paper; both: two files, with the paper's name added.",
)
@click.option("--out", required=True, type=click.Path(path_type=Path), help="The PDF to write.")  # fmt: skip
@told_in_a_sentence
def board(text: str, paper: str, out: Path) -> None:
    """Print a calibration board to a PDF in true scale.

    Print it at 100 %, check the two rulers on it, and glue it onto something flat. A ChArUco board may be seen in part;
    a chessboard must be seen whole. The squares should come out 20 px or wider in the pictures.

    \b
    Examples:
      cathxr calibrate board --out board.pdf
      cathxr calibrate board --board chessboard:9x6:25.0 --paper Letter --out chessboard.pdf
    """
    # Matplotlib takes a second to load, which a wrong option need not wait for.
    wanted = parse_board(text)
    papers = {out.with_name(f"{out.stem}_{each}{out.suffix or '.pdf'}"): each for each in _PAPERS}
    if paper != "both":
        papers = {out: paper}
    for path in papers:
        check_writable(path, what="the board")
    from cathxr.calibration.board_sheet import board_pdf

    drawn = {path: board_pdf(wanted, each) for path, each in papers.items()}
    for path, pdf in drawn.items():
        with written_whole(path) as part:
            part.write_bytes(pdf)
        click.echo(f"{wanted.text} on {papers[path]}: {path}. Print it at 100 % and check the rulers on it.")
