"""What can be wrong with what is asked of a ROS 2 network."""

from mapweave.errors import MapweaveError


class Ros2SourceError(MapweaveError):
    """A word ``ros2:…`` that names no laser.

    Parameters
    ----------
    name
        The word.
    problem
        What is wrong with it.
    """

    def __init__(self, name: str, problem: str) -> None:
        super().__init__(
            f"source {name!r}: {problem}; expected ros2:/TOPIC[@X,Y,DEGREES[,upside-down]], several"
            " joined by +, and ?connect=ENDPOINT&domain=N where these differ"
        )
        self.name = name
        self.problem = problem


class Ros2NetworkError(MapweaveError):
    """What does not name a ROS 2 network.

    Parameters
    ----------
    word
        The word.
    problem
        What is wrong with it.
    """

    def __init__(self, word: str, problem: str) -> None:
        super().__init__(
            f"{word!r}: {problem}; expected ros2: and, where they differ,"
            " ?connect=ENDPOINT&domain=N&distro=NAME"
        )
        self.word = word
        self.problem = problem
